"""What in-plane inertia, which condensation neglects, makes of f01 of a membrane drum.

    ./run python -m tests.benchmarks.inertia

A motion q cos(omega t) stretches the film by q^2 (1 + cos 2 omega t)/2; u follows the first part
statically and the second with its inertia.  Spectral in the radius, no finite elements.
"""

import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from tests.fem.radial import basis
from tests.verification.radial_orbits import Drum

SIZE, NU = 14, 0.16
PAPER = 0.289 / (410e9 * 10e-9)  # mean tension by E h of the drum of demos/fig3.py
HIGHEST = 2.9 / 2  # omega by that of f01, where its doubled branch ends at level 1.6
TOLD = 4.0  # in-plane resonance by f01, from which on a reduction warns (fem.models.inertia)


class Membrane:
    """f01 of a drum of a tension by E h, and what its plane resists with at a frequency."""

    def __init__(self, tension):
        self.drum = Drum(tension, 0.0, NU, 100.0, size=SIZE)
        x, w = np.polynomial.legendre.leggauss(4 * SIZE)
        self.weight = (x + 1) / 4 * w
        u = basis(SIZE, (x + 1) / 2, 1, 1)[0]
        self.mass = np.einsum("q,iq,jq->ij", self.weight, u, u)
        product = "q,ab,aiq,bjq->ij"
        strain, law = self.drum.strain, self.drum.law
        self.stiffness = np.einsum(product, self.weight, law, strain, strain)
        self.slope = self.drum.modes[:, 0] @ self.drum.slopes
        self.stretch = np.stack([0.5 * self.slope**2, np.zeros_like(self.slope)])
        self.load = np.einsum("q,ab,aiq,bq->i", self.weight, law, strain, self.stretch)
        values = scipy.linalg.eigh(self.drum.stiffness, self.drum.mass, eigvals_only=True)
        self.omega = float(np.sqrt(values[0]))
        values = scipy.linalg.eigh(self.stiffness, self.mass, eigvals_only=True)
        self.in_plane = float(np.sqrt(values[0])) / self.omega

    def cubic(self, omega):
        """b of f01 where u answers at a frequency."""
        u = -np.linalg.solve(self.stiffness - omega**2 * self.mass, self.load)
        strain = self.stretch + np.einsum("aiq,i->aq", self.drum.strain, u)
        return ((self.drum.law @ strain)[0] * self.slope * self.weight) @ self.slope

    def changes(self, stiffer):
        """Relative changes of the cubic that f01 feels, and of its frequency ``stiffer`` f01."""
        static = self.cubic(0.0)
        cubic = (2 * static + self.cubic(2 * stiffer * self.omega)) / (3 * static) - 1
        return cubic, cubic * (1 - stiffer**-2) / 2


def main():
    """Print the table."""
    near = brentq(lambda t: Membrane(t).in_plane - TOLD, 1e-3, 1.0)
    print("| drum | in-plane resonance by f01 | moved by f01 | cubic | frequency |")
    print("|---|---|---|---|---|")
    for name, tension in (("the paper's, bending off", PAPER), ("where a warning begins", near)):
        drum = Membrane(tension)
        for stiffer in (1.0, HIGHEST):
            cubic, frequency = drum.changes(stiffer)
            moved = f"{drum.in_plane:.4g} | {stiffer:.3g}"
            print(f"| {name} | {moved} | {cubic:+.1e} | {frequency:+.1e} |")


if __name__ == "__main__":
    main()
