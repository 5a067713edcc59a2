"""The rows of a study: every point of its grids with every sample of its distributions."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy.stats import qmc

from nanorom.devices.variation import MOST, Variation
from nanorom.errors import SceneError
from nanorom.scene import fields as v
from nanorom.types import Array

METHODS = ("sobol", "latin", "random")


@attrs.frozen(field_transformer=v.readers)
class Sampling:
    """How often and how distributions are drawn; raises SceneError.

    samples: None where nothing is drawn; method: of `METHODS`, the first two by scipy.stats.qmc.
    """

    samples: int | None = attrs.field(default=None, metadata=v.integer("samples", 1, MOST))
    method: str = attrs.field(default="sobol", metadata=v.choice("method", METHODS))
    seed: int = attrs.field(default=0, metadata=v.integer("seed", 0, 2**32 - 1))

    def rows(self, varied: Sequence[Variation]) -> list[tuple[Any, ...]]:
        """Values of the variations in their order, the last key of the grid fastest.

        Raises SceneError for samples that are missing or not asked for, and for too many rows.
        """
        drawn = [variation for variation in varied if variation.quantile is not None]
        if drawn and self.samples is None:
            raise SceneError(f"samples: missing; {drawn[0].key} is drawn, how often?")
        if not drawn and self.samples is not None:
            raise SceneError("samples: found beside grids alone; allowed with a key that is drawn")
        grids = [range(len(variation.values) or 1) for variation in varied]
        size = (self.samples or 1) * int(np.prod([len(grid) for grid in grids], dtype=float))
        if size > MOST:
            raise SceneError(f"vary: found {size} rows; allowed: at most {MOST}")
        table = self.drawn(drawn)
        rows = []
        for places in itertools.product(*grids):
            for sample in table:
                numbers = iter(sample.tolist())
                rows.append(
                    tuple(
                        next(numbers) if each.quantile is not None else each.values[place]
                        for each, place in zip(varied, places)
                    )
                )
        return rows

    def drawn(self, drawn: Sequence[Variation]) -> Array:
        """Samples (n, d) in SI of variations that have distributions."""
        shares = self.shares(len(drawn))
        columns = [each.quantile(share) for each, share in zip(drawn, shares.T) if each.quantile]
        return np.column_stack(columns) if columns else shares

    def shares(self, dimensions: int) -> Array:
        """Points (n, d) of the unit cube."""
        count = self.samples or 1
        if not dimensions:
            return np.empty((count, 0))
        if self.method == "random":
            return np.random.default_rng(self.seed).random((count, dimensions))
        if self.method == "latin":
            return np.asarray(qmc.LatinHypercube(dimensions, seed=self.seed).random(count))
        with warnings.catch_warnings():  # counts that are no power of two serve as well here
            warnings.filterwarnings("ignore", message=".*balance properties")
            return np.asarray(qmc.Sobol(dimensions, seed=self.seed).random(count))
