"""What a ring-down tells: rate, nonlinear rate and the frequency that follows the amplitude.

    dA/dt = -g/2 A - e/8 A^3   gives   A^-2 = (A0^-2 + e/(4 g)) exp(g t) - e/(4 g)

for q'' + g q' + e q^2 q' + w0^2 q + b q^3 = 0 (Polunin et al., J. Microelectromech. Syst. 25 (2016)
297, doi:10.1109/JMEMS.2016.2529296), whose frequency is w0 + 3 b A^2/(8 w0).  Where the
frequency is measured the action A^2 w takes the place of A^2: it is what falls so.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy import stats
from scipy.optimize import least_squares

from nanorom.errors import FileError
from nanorom.measurement.data import RingdownRecord
from nanorom.measurement.sweeps.peaks import CONFIDENCE, Estimate
from nanorom.types import Array

LEAST_ROWS = 12
FLOOR = 4.0  # standard deviations of the noise: below, an amplitude is one of noise
LEAST_FALL = 0.1  # of the amplitude
ROUNDS = 3


@attrs.frozen(eq=False, kw_only=True)
class Ringdown:
    """A decay: rate g (1/s) of the squared amplitude, decay time 2/g (s), start A0 in the unit.

    nonlinear_damping: e/g in 1/unit^2, as that of a `Peak`; frequency: f0 in Hz, quality_factor
    w0/g, duffing: b/w0^2 in 1/unit^2, None where no frequency was measured; record, fitted (n,):
    what was used and what the fit has there; unit: of the amplitude.
    """

    rate: Estimate
    decay_time: Estimate
    start: Estimate
    nonlinear_damping: Estimate
    frequency: Estimate | None
    quality_factor: Estimate | None
    duffing: Estimate | None
    record: RingdownRecord
    fitted: Array
    unit: str


def fit_ringdown(record: RingdownRecord) -> Ringdown:
    """Fit a decaying amplitude, and the frequency with it where that was measured.

    Raises FileError where fewer than twelve rows are above the noise, or nothing decays.
    """
    used = _above_noise(record)
    if len(used.time) < LEAST_ROWS:
        raise FileError(
            f"measured data: found {len(used.time)} rows of a ring-down above its noise; allowed: "
            f"at least {LEAST_ROWS}"
        )
    time, size = used.time - used.time[0], _action_root(used) / used.amplitude.max()
    slope = np.polyfit(time, np.log(size), 1, w=size)[0]
    if slope * time[-1] > -LEAST_FALL:
        raise FileError("measured data: amplitude: does not fall with time; allowed: a ring-down")
    p = np.array([np.log(-2 * slope), 0.1, np.log(size[0])])
    noise: Array = np.full(len(size), 0.02)
    for _ in range(ROUNDS):
        found = least_squares(
            _miss, p, bounds=([-np.inf, 0, -np.inf], np.inf), args=(time, size, noise)
        )
        p = found.x
        fitted = _decay(p, time)
        noise = np.hypot(0.5 * fitted, 0.5) * max(float(np.std(fitted - size)), 1e-9)
    freedom = len(size) - len(p)
    variance = float(found.fun @ found.fun) / freedom
    covariance = variance * np.linalg.pinv(found.jac.T @ found.jac)
    quantile = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom))
    rate, damping, start = np.exp(p[0]), p[1] / used.amplitude.max() ** 2, np.exp(p[2])
    width = quantile * np.sqrt(np.diag(covariance))
    told = _of_frequency(used, fitted * used.amplitude.max(), rate, rate * width[0], quantile)
    return Ringdown(
        rate=Estimate(float(rate), float(rate * width[0])),
        decay_time=Estimate(float(2 / rate), float(2 / rate * width[0])),
        start=Estimate(
            float(start * used.amplitude.max()), float(start * width[2] * used.amplitude.max())
        ),
        nonlinear_damping=Estimate(float(damping), float(width[1] / used.amplitude.max() ** 2)),
        frequency=told[0],
        quality_factor=told[1],
        duffing=told[2],
        record=used,
        fitted=fitted * used.amplitude.max() * used.amplitude / _action_root(used),
        unit=record.unit,
    )


def _action_root(used: RingdownRecord) -> Array:
    """Amplitudes (n,) in their unit, a factor sqrt(w/w0) larger where w was measured.

    It is the action, A^2 w of a nearly harmonic motion, that g takes away.
    """
    if used.frequency is None or np.isnan(used.frequency).any():
        return used.amplitude
    return np.asarray(used.amplitude * np.sqrt(used.frequency / used.frequency.min()))


def _miss(p: Array, time: Array, size: Array, noise: Array) -> Array:
    return np.asarray((_decay(p, time) - size) / noise)


def _decay(p: Array, time: Array) -> Array:
    """Amplitude (n,) for log g, e/g by the largest squared amplitude, and log A0."""
    rate, damping, start = np.exp(p[0]), p[1], np.exp(p[2])
    grown = np.exp(np.minimum(rate * time, 600))
    return np.asarray(1 / np.sqrt((start**-2 + 0.25 * damping) * grown - 0.25 * damping))


def _above_noise(record: RingdownRecord) -> RingdownRecord:
    """The rows from the largest amplitude to where the noise is reached."""
    size, first = record.amplitude, int(record.amplitude.argmax())
    scatter = float(np.median(np.abs(np.diff(size[first:])))) if len(size) - first > 2 else 0.0
    below = np.flatnonzero(size[first:] < FLOOR * scatter)
    rows = slice(first, first + int(below[0]) if len(below) else None)
    own = None if record.frequency is None else record.frequency[rows]
    return attrs.evolve(record, time=record.time[rows], amplitude=size[rows], frequency=own)


def _of_frequency(
    used: RingdownRecord, size: Array, rate: float, width: float, quantile: float
) -> tuple[Estimate | None, Estimate | None, Estimate | None]:
    """f0, Q and b/w0^2 from the frequencies (n,) along a decay, weighted by the amplitude."""
    if used.frequency is None or np.isnan(used.frequency).any():
        return None, None, None
    scale = float(size.max()) ** 2
    table = np.column_stack([np.ones_like(size), size**2 / scale])
    weight = size / size.max()  # the noise of a frequency goes with the inverse of the amplitude
    rows, right = table * weight[:, None], used.frequency * weight
    (place, slope), *_ = np.linalg.lstsq(rows, right, rcond=None)
    left = right - rows @ [place, slope]
    variance = float(left @ left) / (len(left) - 2)
    errors = quantile * np.sqrt(variance * np.diag(np.linalg.inv(rows.T @ rows)))
    frequency = Estimate(float(place), float(errors[0]))
    quality = 2 * np.pi * place / rate
    duffing = 8 / 3 * slope / place / scale
    error = 8 / 3 * errors[1] / place / scale
    return (
        frequency,
        Estimate(float(quality), float(quality * width / rate)),
        Estimate(float(duffing), float(error)),
    )
