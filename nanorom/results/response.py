"""Frequency responses of a reduced model at several drive levels (step V of the paper)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import attrs
import h5py
import numpy as np
from numpy.typing import NDArray

from nanorom.continuation import Diagram, SpecialPoint
from nanorom.errors import FileError
from nanorom.files import hdf5, layout, schema, stored
from nanorom.files.stored import Reader, Writer
from nanorom.results import diagram_file, table
from nanorom.results.estimates import Estimates
from nanorom.results.readings import Output
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Excitation, Sweep
from nanorom.scene.fields import parse_toml
from nanorom.scene.instrument import Instrument

KEY = "key"  # attribute: what the levels were computed from, so that a run can go on
EXCITATION = "excitation"  # attribute: drive and sweep, as TOML


@layout.documented
@attrs.frozen(eq=False, kw_only=True, repr=False)
class Response:
    """The response diagrams of one model, one per drive level.

    diagrams: omega in rad/s, amplitudes (n, L) in m; drive: the levels; sweep: the range. Read
    from the file of a run that has not ended, it holds the levels finished so far, and
    ``unfinished`` counts the others.  estimates: of what points of each level are wrong by, where
    the model came with a larger one.  readout: what makes a voltage of the motion, if anything.
    """

    FORMAT: ClassVar[str] = "nanorom-response"
    FORMAT_VERSION: ClassVar[int] = 1

    diagrams: tuple[Diagram, ...]
    drive: Drive
    sweep: Sweep
    frequency: NDArray[np.float64] = attrs.field(
        metadata=schema.array("L", "Hz", "natural frequencies")
    )
    label: tuple[str, ...] = attrs.field(
        metadata=schema.array("L", "", "names of the modes", kind="name")
    )
    outside_label: tuple[str, ...] | None = attrs.field(
        default=None,
        metadata=schema.array(
            "K", "", "names of modes that the model lacks, with which it was compared", kind="name"
        ),
    )
    estimates: tuple[Estimates, ...] = ()
    readout: Instrument | None = None
    unfinished: int = 0

    def __repr__(self) -> str:
        lines = [f"Response of {len(self.label)} modes at {len(self.diagrams)} drive levels"]
        for level, diagram in zip(self.drive.told, self.diagrams):
            kinds = [point.type for point in diagram.special_points]
            found = ", ".join(f"{kinds.count(kind)} {kind}" for kind in sorted(set(kinds)))
            branches = f"{len(diagram.branches)} branches"
            lines.append(f"{level}: {branches}, {found or 'no special points'}")
        return "\n".join(lines + [f"{self.unfinished} to do"] * bool(self.unfinished))

    def _repr_html_(self) -> str:
        return stored.html(self)

    def estimated(self, level: int, point: SpecialPoint) -> int | None:
        """Row of a level's estimates (from 0) that a special point has, None if it has none."""
        if not self.estimates:
            return None
        known = self.estimates[level]
        own = (known.omega == point.omega) & (known.branch == point.branch)
        rows = [int(row) for row in np.flatnonzero(own) if known.type[row] == point.type]
        return rows[0] if rows else None

    @property
    def error(self) -> float:
        """Largest estimated relative error of a point, NaN if there are no estimates."""
        errors = [float(known.error.max(initial=0.0)) for known in self.estimates]
        return max(errors, default=float("nan"))

    def table(self, output: Output | None = None, harmonic: object = 1) -> dict[str, Any]:
        """Every point of every branch, and every special point, as columns (n,) by name.

        output : "f01", the place of a mode from 0, or values (L,) of the mode shapes at a point of
            the film, `model.shapes.at((1e-6, 0.0))`: adds its quadratures, phase and decibels, and
            with a readout those of its voltage
        harmonic : of the drive's frequency; "1/2" for what has twice its period

        `nanorom.results.table.columns` says which, and their units; `pandas.DataFrame` takes it.
        Raises ContinuationError for an output or a harmonic that is not there.
        """
        return table.columns(self, output, harmonic)

    @property
    def excitation(self) -> str:
        """Drive, sweep and readout, as TOML."""
        return Excitation(drive=self.drive, sweep=self.sweep, readout=self.readout).to_toml()

    def save(self, path: str | Path, key: str = "") -> None:
        """Write `response.h5`, whole or not at all; raises FileError.

        key: what the levels were computed from, so that a run can go on.
        """
        with hdf5.create(path, self.FORMAT, self.FORMAT_VERSION) as file:
            write_head(file, self, key)
            for number, diagram in enumerate(self.diagrams):
                write_level(file, number, diagram, self)
            for number, estimates in enumerate(self.estimates):
                schema.give(estimates, Writer(file), f"level/{number}/estimates")

    @classmethod
    def load(cls, path: str | Path) -> Response:
        """Read `response.h5`; raises FileError naming the file and what is wrong with it."""
        with hdf5.opened(path, cls.FORMAT, cls.FORMAT_VERSION) as file:
            response, total = _read_head(file)
            levels = hdf5.group(file, "level")
            done = [number for number in range(total) if str(number) in levels]
            # a run that was interrupted says what it is the beginning of
            if len(done) < total and KEY not in file.attrs or not done:
                raise FileError(f"level/{min(set(range(total)) - set(done))}: missing")
            size = len(response.frequency)
            groups = {number: hdf5.group(file, f"level/{number}") for number in done}
            whole = with_levels(
                response, {n: diagram_file.read_diagram(g, size) for n, g in groups.items()}
            )
            if not all("estimates" in group for group in groups.values()):
                return whole
            lengths = {"K": len(response.outside_label or ())}
            tables = [
                Estimates(**schema.take(Estimates, Reader(group, dict(lengths)), "estimates"))
                for group in groups.values()
            ]
            return attrs.evolve(whole, estimates=tuple(tables))


def write_head(file: h5py.File, response: Response, key: str) -> None:
    """Write what all levels share into a new file."""
    file.attrs[EXCITATION] = response.excitation
    if key:
        file.attrs[KEY] = key
    schema.give(response, Writer(file))
    file.create_group("level")


def write_level(file: h5py.File, number: int, diagram: Diagram, response: Response) -> None:
    """Write the diagram of one level."""
    group = file.create_group(f"level/{number}")
    diagram_file.write_diagram(group, diagram, len(response.frequency))


def _read_head(file: h5py.File) -> tuple[Response, int]:
    """A response without its diagrams, and how many levels it has when it is complete."""
    excitation = Excitation.from_dict(parse_toml(hdf5.text(file.attrs[EXCITATION])))
    known = schema.take(Response, Reader(file))
    response = Response(
        diagrams=(),
        drive=excitation.drive,
        sweep=excitation.sweep,
        readout=excitation.readout,
        **known,
    )
    return response, len(excitation.drive.levels)


def with_levels(response: Response, diagrams: Mapping[int, Diagram]) -> Response:
    """A response of all levels, with the diagrams of some of them (by number, from 0) alone."""
    drive, done = response.drive, sorted(diagrams)
    if len(done) < len(drive.levels):
        direct, parametric = zip(*(drive.levels[number] for number in done))
        drive = attrs.evolve(drive, direct=direct, parametric=parametric)
    return attrs.evolve(
        response,
        diagrams=tuple(diagrams[number] for number in done),
        drive=drive,
        unfinished=len(response.drive.levels) - len(done),
    )
