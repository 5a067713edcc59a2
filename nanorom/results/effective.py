"""What a fit of a single oscillator to one mode returns, and why: a table, a file, a text."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import attrs
import numpy as np

from nanorom.continuation.system import ModalSystem
from nanorom.errors import ModelError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.schema import array, note
from nanorom.rom.manifold.coefficients import ROUND_OFF, Coefficients, coefficients, series
from nanorom.rom.manifold.equations import equations_of
from nanorom.rom.manifold.reduced import Reduced, manifold
from nanorom.rom.model import ReducedModel
from nanorom.scene.units import tabulated, with_unit
from nanorom.types import Array

POINTS = 41  # amplitudes of the curves
FIT_ORDER = 15  # of the Duffing oscillator's own backbone
LEADING = 1e-4  # of the largest part: smaller ones are summed in the text
MOST_ROWS = 12


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class Effective:
    """Effective coefficients of one mode of a model, by what causes them and by amplitude.

    m q'' + (c + eta q^2) q' + k q + beta q^3 + delta q^5 = F.  Raises ModelError if arrays do not
    fit.
    """

    FORMAT: ClassVar[str] = "nanorom-effective"
    FORMAT_VERSION: ClassVar[int] = 1

    mode: str = attrs.field(metadata=note("text", "name of the mode"))
    order: int = attrs.field(
        converter=int, metadata=note("number", "of the manifold that the curves are of")
    )
    label: tuple[str, ...] = attrs.field(metadata=array("L", "", "names of the modes", kind="name"))
    frequency: Array = attrs.field(metadata=array("L", "Hz", "their natural frequencies"))
    mass: float = attrs.field(
        converter=float, metadata=note("number", "modal mass of the mode, kg")
    )
    damping: float = attrs.field(converter=float, metadata=note("number", "c, kg/s"))
    stiffness: float = attrs.field(converter=float, metadata=note("number", "k, N/m"))
    cubic: float = attrs.field(converter=float, metadata=note("number", "beta, N/m^3"))
    quintic: float = attrs.field(converter=float, metadata=note("number", "delta, N/m^5"))
    cubic_damping: float = attrs.field(converter=float, metadata=note("number", "eta, N s/m^3"))
    offset: float = attrs.field(
        converter=float, metadata=note("number", "mean q by a^2: what quadratic forces make, 1/m")
    )
    part: tuple[str, ...] = attrs.field(
        metadata=array("t", "", "what the coefficients come from", kind="name")
    )
    part_cubic: Array = attrs.field(metadata=array("t", "N/m^3", "what each adds to beta"))
    part_quintic: Array = attrs.field(metadata=array("t", "N/m^5", "what each adds to delta"))
    part_damping: Array = attrs.field(metadata=array("t", "N s/m^3", "what each adds to eta"))
    kerr: Array = attrs.field(
        metadata=array(
            "L", "rad/s/m^2", "shift of each mode's frequency by a^2 of this one", finite=False
        )
    )
    photon: Array = attrs.field(
        metadata=array("L", "rad/s", "the same by a quantum of its energy", finite=False)
    )
    dispersive: Array = attrs.field(
        metadata=array("L", "", "0 where a resonance is so near that energy passes", kind="flag")
    )
    largest: Array = attrs.field(metadata=array("n", "m", "largest q of free motions"))
    amplitude: Array = attrs.field(metadata=array("n", "m", "a, of the first harmonic of q"))
    omega: Array = attrs.field(metadata=array("n", "rad/s", "frequency of the free motion"))
    duffing: Array = attrs.field(
        metadata=array("n", "rad/s", "that of the oscillator with beta alone")
    )
    fitted: Array = attrs.field(
        metadata=array("n", "N/m^3", "beta of a fit to all amplitudes up to each")
    )
    decay: Array = attrs.field(metadata=array("n", "1/s", "rate at which the amplitude decays"))
    error: Array = attrs.field(
        metadata=array("n", "", "estimated relative error of frequency or motion")
    )

    def __attrs_post_init__(self) -> None:
        schema.check(self)

    def __repr__(self) -> str:
        return f"Effective: {self.text()}"

    def _repr_html_(self) -> str:
        return stored.html(self)

    @property
    def misfit(self) -> Array:
        """(n,) how far the fit at low drive is off at each amplitude, in linewidths; NaN without
        damping.
        """
        width = self.damping / self.mass or np.nan
        return np.asarray((self.duffing - self.omega) / width)

    @property
    def validity(self) -> float:
        """Largest q in m of the curves: up to which they hold."""
        return float(self.largest[-1])

    def save(self, path: str | Path) -> None:
        """Write `effective.h5`, whole or not at all; raises FileError."""
        stored.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Effective:
        """Read `effective.h5`; raises FileError."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            return stored.read(cls, file)

    def text(self) -> str:
        """The coefficients, what they come from, and how far a fit misleads."""
        own = self.label.index(self.mode)
        head = f"{self.mode} at {with_unit(float(self.frequency[own]), 'Hz', 8)}, manifold of order"
        lines = [f"{head} {self.order}, valid to {with_unit(self.validity, 'm', 3)}"]
        return "\n".join([*lines, "", *self._parts(), "", *self._kerr(), "", *self._misled()])

    def _parts(self) -> list[str]:
        sizes = np.abs(self.part_cubic) / (np.abs(self.part_cubic).max() or 1.0)
        sizes += np.abs(self.part_quintic) / (np.abs(self.part_quintic).max() or 1.0)
        order = np.argsort(-sizes, kind="stable")
        shown = [int(i) for i in order[:MOST_ROWS] if sizes[i] > LEADING]
        rest = np.setdiff1d(np.arange(len(self.part)), shown)
        names = ["effective", *(self.part[i] for i in shown), *["all others"] * bool(len(rest))]
        columns = [("", names, "")]
        for title, total, parts, unit in (
            ("cubic", self.cubic, self.part_cubic, "N/m^3"),
            ("quintic", self.quintic, self.part_quintic, "N/m^5"),
            ("damping", self.cubic_damping, self.part_damping, "N s/m^3"),
        ):
            values = [total, *parts[shown], *[parts[rest].sum()] * bool(len(rest))]
            columns.append((title, *tabulated(values, unit, 5)))
        return _table(columns)

    def _kerr(self) -> list[str]:
        shown = [i for i in range(len(self.label)) if np.isfinite(self.kerr[i])][:MOST_ROWS]
        shift, unit = tabulated(self.kerr[shown] / (2 * np.pi) * 1e-18, "Hz", 4)
        photon, other = tabulated(self.photon[shown] / (2 * np.pi), "Hz", 4)
        names = [self.label[i] + ("" if self.dispersive[i] else " (resonant)") for i in shown]
        columns = [("shift of", names, ""), ("by nm^2", shift, unit), ("by quantum", photon, other)]
        return _table(columns)

    def _misled(self) -> list[str]:
        last = self.fitted[-1] / self.cubic - 1 if self.cubic else np.nan
        text = f"a fit up to {with_unit(self.validity, 'm', 3)} returns a cubic coefficient "
        lines = [f"{text}{100 * last:+.1f} % from that of small amplitudes"]
        if np.isfinite(self.misfit[-1]):
            lines.append(
                f"there the fit at small amplitudes is off by {self.misfit[-1]:+.2f} linewidths"
            )
        return lines


def _table(columns: list[tuple[str, list[str], str]]) -> list[str]:
    cells = [[f"{title} ({unit})" if unit else title, *values] for title, values, unit in columns]
    widths = [max(map(len, column)) for column in cells]
    rows = zip(*cells)
    return ["  ".join(c.ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows]


def effective(
    model: ReducedModel, mode: int | str = 1, order: int = 7, reach: float | None = None
) -> Effective:
    """Effective coefficients of a mode, by number or label, on its manifold of an order.

    reach : amplitude in m that the curves are to have, for which the order is raised.

    Raises ModelError for a mode that does not exist or that a resonance ties to another, an order
    out of range, or a reach that no order has.
    """
    reduced = manifold(model, [mode], order, reach=reach)
    found = coefficients(model, mode)
    top = reduced.validity if reach is None else reach
    if not top > 0:
        raise ModelError(f"order: found {order}, which holds at no amplitude; take another")
    x = np.linspace(0.0, top, POINTS)
    motions = reduced.motions(x)
    place = found.mode
    unit = reduced.equations.amplitude
    a = np.array([2 * abs(np.fft.fft(m.q[:, place])[1]) / len(m.q) for m in motions]) * unit
    omega = np.array([m.rate for m in motions]) * reduced.equations.frequency
    parts = {**found.parts, "together": found.together}
    c, k = model.damping[place, place], model.mass[place] * omega[0] ** 2
    sizes = found.total.cubic, found.total.cubic**2 / k, c * found.total.cubic / k
    rows = np.array([[p.cubic, p.quintic, p.damping] for p in (found.total, *parts.values())])
    rows[np.abs(rows) < ROUND_OFF * np.maximum(np.abs(sizes), np.abs(rows).max(axis=0))] = 0.0
    (cubic, quintic, loss), shares = rows[0].tolist(), rows[1:].T
    return Effective(
        mode=model.label[place],
        order=reduced.order,
        label=model.label,
        frequency=model.frequency,
        mass=model.mass[place],
        damping=c,
        stiffness=k,
        cubic=cubic,
        quintic=quintic,
        cubic_damping=loss,
        offset=found.total.offset,
        part=tuple(parts),
        part_cubic=shares[0],
        part_quintic=shares[1],
        part_damping=shares[2],
        kerr=found.kerr,
        photon=found.photon,
        dispersive=found.dispersive,
        largest=x,
        amplitude=a,
        omega=omega,
        duffing=_duffing(found, k, omega[0], a),
        fitted=_fitted(omega, a, model.mass[place]),
        decay=_decay(reduced, a),
        error=reduced.error(x),
    )


def _duffing(found: Coefficients, stiffness: float, omega: float, a: Array) -> Array:
    """Frequencies (n,) of the oscillator with the cubic coefficient alone, at a (n,)."""
    sign = float(np.sign(found.total.cubic)) or 1.0
    system = ModalSystem(stiffness=[1.0], damping=[0.0], cubic=[[[[sign]]]], damped=False)
    terms = series(equations_of(system, [1], None, None)[0], 0, 0, FIT_ORDER).frequency
    size = abs(found.total.cubic) * a**2 / stiffness
    return np.asarray(omega * np.polynomial.polynomial.polyval(size, terms))


def _fitted(omega: Array, a: Array, mass: float) -> Array:
    """beta (n,) of least squares of omega - omega_0 = 3 beta a^2 / (8 m omega_0) up to each a."""
    shift = np.cumsum((omega - omega[0]) * a**2)
    square = np.cumsum(a**4)
    slope = shift[1:] / square[1:]
    return np.asarray(8 / 3 * mass * omega[0] * np.append(slope[0], slope))


def _decay(reduced: Reduced, a: Array) -> Array:
    """Decay rates (n,) in 1/s at amplitudes a (n,) of the first harmonic."""
    equations = reduced.equations
    place = int(reduced.masters[0])
    terms = series(equations, place, int(reduced.coordinates[0]), reduced.order).decay
    return np.asarray(
        np.polynomial.polynomial.polyval((a / equations.amplitude) ** 2, terms)
        * equations.frequency
    )
