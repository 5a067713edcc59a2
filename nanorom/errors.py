"""Errors that reach the user as one line: what is wrong, and what to do about it."""


class NanoromError(Exception):
    """Base of every error that nanorom raises on purpose."""


class SceneError(NanoromError):
    """A scene, a sweep or a quantity is not valid."""


class MeshError(NanoromError):
    """A geometry cannot be meshed or a mesh cannot be used."""


class SolverError(NanoromError):
    """A linear, nonlinear or eigenvalue solve did not give a trustworthy result."""


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
