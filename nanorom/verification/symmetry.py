"""Classes of symmetry that take part in a motion, and products of fields of several classes.

A field on the whole film is a sum of parts, one of each class of symmetry; on the meshed part the
film's images see them with signs.  There products are pointwise: a Walsh-Hadamard transform over
the classes goes to the images and back, as a Fourier transform does for harmonics.
"""

from __future__ import annotations

from collections.abc import Iterable

import attrs
import numpy as np

from nanorom.fem.symmetry import Parity, product_parity


@attrs.frozen
class Classes:
    """Classes that a cubic force does not leave: those of a group, times one of them.

    deflections, strains : parity of each; the product of two deflections is a strain, that of a
        strain and a deflection a deflection, and numbers multiply as the bits of their places do.
    """

    deflections: tuple[Parity, ...]
    strains: tuple[Parity, ...]

    @classmethod
    def spanned(cls, parities: Iterable[Parity]) -> Classes:
        """The smallest such set that has some given classes in it."""
        first, *others = sorted(set(parities))
        strains = [product_parity(first, first)]
        for other in others:
            step = product_parity(first, other)
            if step not in strains:
                strains += [product_parity(step, strain) for strain in strains]
        deflections = tuple(product_parity(first, strain) for strain in strains)
        return cls(deflections, tuple(strains))

    @property
    def count(self) -> int:
        """Number of classes, a power of two."""
        return len(self.strains)


def images(parts: np.ndarray) -> np.ndarray:
    """Fields (classes, ...) by class as the images of a point see them (images, ...).

    Applied twice it multiplies by the number of classes.
    """
    count = len(parts)
    if count == 1:
        return parts
    pairs = parts.reshape(count // 2, 2, *parts.shape[1:])
    even, odd = pairs[:, 0], pairs[:, 1]
    found = np.empty_like(pairs)
    found[:, 0] = images(even + odd)
    found[:, 1] = images(even - odd)
    return found.reshape(parts.shape)
