"""What an orbit of a model is wrong by to first order: one step of Newton's method in more modes.

The step is taken across the branch, in the hyperplane orthogonal to its tangent, so that it is
small beside a fold as elsewhere: dx = a + b drate with J a = -R, J b = -dR/drate, and
drate = -(b . a) / (1 + b . b).  A mode outside answers for the part of it that its own motion
makes: its force on the modes inside is solved for alone.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.linalg import lapack

from nanorom.continuation.larger.equations import LargerSystem, Seen
from nanorom.continuation.orbits.orbit import orbit_amplitudes
from nanorom.types import Array

LOST = 1e3  # relative: a correction beyond that says nothing


def change_of(amplitudes: Array, before: float) -> Array:
    """Relative change of amplitudes (n,); 0 of one that is at rest before and after."""
    if before == 0:
        return np.where(amplitudes == 0, 0.0, np.inf)
    return amplitudes / before - 1


@attrs.frozen(eq=False)
class Correction:
    """Of an orbit of a model, as scaled coefficients x and a rate.

    omega, amplitude: relative changes of the frequency and of the amplitude of the largest mode;
    shares (N,): what each mode outside makes of the larger of the two; moving (N,): max |q_r| of
    all modes once corrected, scaled.
    """

    seen: Seen
    x: Array
    rate: float
    slope: Array
    omega: float
    amplitude: float
    shares: Array
    moving: Array

    @property
    def size(self) -> float:
        """The larger relative change."""
        return max(abs(self.omega), abs(self.amplitude))


def first_correction(larger: LargerSystem, seen: Seen) -> Correction:
    """The step of Newton's method from an orbit of the model."""
    balance, basis, x, rate = seen.balance, seen.basis, seen.x, seen.rate
    jacobian = balance.jacobian_t(x, rate).T
    factors, pivots, _ = lapack.dgetrf(jacobian)
    by_rate = basis.pack(balance.rate_derivative(x, rate))
    forces = np.column_stack([-basis.pack(balance.residual(x, rate)), -by_rate])
    a, b = lapack.dgetrs(factors, pivots, forces)[0].T
    across = 1.0 + b @ b
    by = float(-(b @ a) / across)
    change = a + by * b
    modes = seen.modes
    own = [r for r in larger.outside if (modes == r).any()]
    columns = np.zeros((len(a), len(own)))
    for k, r in enumerate(own):
        columns[modes == r, k] = change[modes == r]
    pulled = jacobian @ columns
    pulled[np.isin(modes, larger.outside)] = 0.0
    alone = lapack.dgetrs(factors, pivots, -pulled)[0]
    rates = -(b @ alone) / across
    alone += np.outer(b, rates)
    before = basis.expand(x, larger.scaled.size)
    parts = [change, *alone.T]
    after = [before + basis.expand(basis.unpack(part), larger.scaled.size) for part in parts]
    amplitudes = orbit_amplitudes(np.array([before, *after]))
    largest = larger.inside[int(amplitudes[0, larger.inside].argmax())]
    relative = change_of(amplitudes[:, largest], float(amplitudes[0, largest]))
    shares = np.zeros(larger.scaled.size)
    shares[own] = np.maximum(np.abs(rates) / rate, np.abs(relative[2:]))
    return Correction(
        seen=seen,
        x=x + basis.unpack(change),
        rate=rate + by,
        slope=b,
        omega=by / rate,
        amplitude=float(relative[1]),
        shares=np.nan_to_num(shares, nan=LOST),
        moving=amplitudes[1],
    )
