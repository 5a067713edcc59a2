"""Errors that reach the user as one line: what is wrong, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping


class NanoromError(Exception):
    """Base of every error that nanorom raises on purpose."""


class SceneError(NanoromError):
    """A scene, a sweep or a quantity is not valid."""


class MeshError(NanoromError):
    """A geometry cannot be meshed or a mesh cannot be used."""


class SolverError(NanoromError):
    """A linear, nonlinear or eigenvalue solve did not give a trustworthy result."""


class LoadError(SolverError):
    """A static load cannot be applied as a whole.

    reached : the share of the load, or the load in its own unit, at the last state that was found.
    """

    def __init__(self, message: str, reached: float) -> None:
        super().__init__(message, reached)
        self.reached = reached

    def __str__(self) -> str:
        return str(self.args[0])


class SlowPlaneError(SolverError):
    """The film's plane does not follow some modes statically.

    classes : of symmetry of each mode that was asked for, by its number.
    """

    def __init__(self, message: str, classes: Mapping[int, tuple[int, ...]]) -> None:
        super().__init__(message, classes)
        self.classes = classes

    def __str__(self) -> str:
        return str(self.args[0])


class ModelError(NanoromError):
    """The arrays of a reduced model do not fit together."""


class FileError(NanoromError):
    """A file cannot be read, written or understood."""


class ContinuationError(NanoromError):
    """A modal system or a continuation request cannot be followed."""


class AmbiguityWarning(UserWarning):
    """More than one reading of a measurement is left; the result lists the others."""


class AccuracyWarning(UserWarning):
    """A result is less accurate than was asked for; the message says by how much."""


class ScaleWarning(UserWarning):
    """Measured data have a scale that is not known; the message says which was taken."""
