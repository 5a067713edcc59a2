"""Results and their files: which class a file of a kind is for, written and read by its schema.

A new kind of file is a class whose fields declare what they are (`nanorom.files.schema`), with a
``FORMAT`` and a ``FORMAT_VERSION``, and one row of KINDS.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import attrs
import h5py
import numpy as np

from nanorom.errors import FileError
from nanorom.files import hdf5, schema
from nanorom.files.schema import AXES, Item, Lengths

Content = TypeVar("Content")

DTYPES: dict[str, Any] = {"flag": np.uint8, "complex": complex}  # in files, of kinds of arrays


@attrs.frozen
class Kind:
    """A kind of file: its usual name, and who loads it, says what it holds, and draws it.

    These are "module:function", loaded when they are needed.  text(content) gives what
    `nanorom info` prints; draw(content, path, folder, measured) writes pictures of the file at a
    path into a folder; html(content) gives what a notebook shows; page(content, path) gives the
    live page of the file at a path.
    """

    name: str
    load: str
    text: str
    draw: str
    html: str
    page: str


KINDS = {
    "nanorom-rom": Kind(
        "rom.h5",
        "nanorom.rom.model:ReducedModel.load",
        "nanorom.report.text:model_text",
        "nanorom.plots.files:draw_model",
        "nanorom.report.notebook:model_html",
        "nanorom.report.page:model_page",
    ),
    "nanorom-response": Kind(
        "response.h5",
        "nanorom.results.response:Response.load",
        "nanorom.report.text:response_text",
        "nanorom.plots.files:draw_response",
        "nanorom.report.notebook:response_html",
        "nanorom.report.page:response_page",
    ),
    "nanorom-verified": Kind(
        "verified.h5",
        "nanorom.results.verified:Verified.load",
        "nanorom.results.verified:Verified.text",
        "nanorom.plots.files:draw_verified",
        "nanorom.report.notebook:verified_html",
        "nanorom.report.page:verified_page",
    ),
    "nanorom-loadcurve": Kind(
        "tuning.h5",
        "nanorom.results.loadcurve:LoadCurve.load_file",
        "nanorom.results.loadcurve:LoadCurve.text",
        "nanorom.plots.files:draw_load_curve",
        "nanorom.report.notebook:load_curve_html",
        "nanorom.report.page:load_curve_page",
    ),
    "nanorom-effective": Kind(
        "effective.h5",
        "nanorom.results.effective:Effective.load",
        "nanorom.results.effective:Effective.text",
        "nanorom.plots.files:draw_effective",
        "nanorom.report.notebook:effective_html",
        "nanorom.report.page:effective_page",
    ),
    "nanorom-design": Kind(
        "design.h5",
        "nanorom.results.design:Design.load",
        "nanorom.report.design:design_text",
        "nanorom.plots.files:draw_design",
        "nanorom.report.notebook:design_html",
        "nanorom.report.page:design_page",
    ),
    "nanorom-study": Kind(
        "study.h5",
        "nanorom.results.study:Study.load",
        "nanorom.report.study:study_text",
        "nanorom.plots.files:draw_study",
        "nanorom.report.notebook:study_html",
        "nanorom.report.page:study_page",
    ),
}


UNKNOWN = "nanorom-rom"  # whose reader tells what is wrong with a file that is of no format


def kind_of(path: str | Path) -> Kind:
    """The kind of a file; raises FileError if it is of another."""
    found = hdf5.kind_of(path) or UNKNOWN
    if found not in KINDS:
        *names, last = (f"a {kind.name}" for kind in KINDS.values())
        allowed = f"{', '.join(names)} or {last}"
        raise FileError(f"{path}: an HDF5 file of format {found!r}; expected {allowed}")
    return KINDS[found]


def call(function: str, *arguments: Any, **options: Any) -> Any:
    """Call a "module:function", or a method of a class there."""
    module, _, name = function.partition(":")
    target: Any = import_module(module)
    for part in name.split("."):
        target = getattr(target, part)
    return target(*arguments, **options)


def html(content: Any) -> str:
    """What a notebook shows of a result."""
    return str(call(KINDS[content.FORMAT].html, content))


def load(path: str | Path) -> Any:
    """What any of nanorom's files holds, as an object of its class; raises FileError."""
    return call(kind_of(path).load, path)


def given(cls: type[Content], content: Content | str | Path) -> Content:
    """A result of a class as it is, or from the file of a name; raises FileError."""
    if isinstance(content, cls):
        return content
    name = KINDS[cls.FORMAT].name  # type: ignore[attr-defined]
    if isinstance(content, (str, Path)):
        found = kind_of(content)
        if found is not KINDS[cls.FORMAT]:  # type: ignore[attr-defined]
            raise FileError(f"{content}: found a {found.name}; expected a {name}")
        return call(found.load, content)  # type: ignore[no-any-return]
    raise FileError(
        f"found {_article(type(content).__name__)}; allowed: {_article(cls.__name__)}, or the "
        f"name of its file, such as {name}"
    )


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"


def save(
    content: Any, path: str | Path, units: Mapping[str, str] | None = None, **attributes: str
) -> None:
    """Write a result by its schema, whole or not at all; raises FileError.

    units: of arrays whose schema leaves several; attributes: of the file, beside what the schema
    says.
    """
    with hdf5.create(path, content.FORMAT, content.FORMAT_VERSION) as file:
        file.attrs.update(attributes)
        schema.give(content, Writer(file, units or {}))


def read(cls: type[Content], file: h5py.File, most: Lengths | None = None) -> Content:
    """A result of a class from its open file; ``most``: how long axes may be at most."""
    return cls(**schema.take(cls, Reader(file, most=most or {})))


@attrs.frozen
class Writer:
    """Where a result is written: a group of a file."""

    parent: h5py.Group
    units: Mapping[str, str] = attrs.field(factory=dict)

    def group(self, path: str) -> None:
        self.parent.require_group(path)

    def array(self, path: str, item: Item, value: Any) -> None:
        if item.kind == "name":
            hdf5.write_names(self.parent, path, tuple(value))
        else:
            value = np.asarray(value, dtype=DTYPES.get(item.kind))
            hdf5.write(self.parent, path, value, self.units.get(path, item.unit) or None)

    def note(self, path: str, kind: str, value: Any) -> None:
        if kind == "facts":
            hdf5.write_attributes(self.parent.create_group(path), value)
        elif value is not None:
            self.parent.attrs[path] = (
                json.dumps(value, sort_keys=True) if kind == "words" else value
            )


@attrs.frozen
class Reader:
    """Where a result is read from: a group of a file, lengths of axes as far as they are known."""

    parent: h5py.Group
    lengths: Lengths = attrs.field(factory=dict)
    most: Lengths = attrs.field(factory=dict)

    def has(self, path: str) -> bool:
        return path in self.parent

    def names(self, path: str) -> list[str]:
        return sorted(hdf5.group(self.parent, path))

    def array(self, path: str, item: Item) -> Any:
        shape, kinds = item.shape(self.lengths), schema.KINDS[item.kind]
        found = hdf5.dataset(self.parent, path, shape, kinds).shape
        for axis, length in zip(item.axes, found):
            if length > self.most.get(axis, length):
                counted = AXES[axis]
                raise FileError(f"{path}: found {length} {counted}; at most {self.most[axis]}")
        item.fit(path, found, self.lengths)
        if item.kind == "name":
            return hdf5.read_names(self.parent, path, shape[0])
        value = hdf5.read(self.parent, path, found, kinds)
        if item.finite:
            schema.expect_finite(path, value)
        return value.astype(bool) if item.kind == "flag" else value

    def note(self, path: str, kind: str) -> Any:
        if kind == "facts":
            return hdf5.read_attributes(hdf5.group(self.parent, path))
        if kind == "number":
            return float(self.parent.attrs[path]) if path in self.parent.attrs else None
        if kind == "text":
            return hdf5.text(self.parent.attrs.get(path, ""))
        return hdf5.from_json(hdf5.text(self.parent.attrs.get(path, "{}")))
