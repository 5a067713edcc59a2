"""Mesh files of others: what gmsh must not be given.

A geometry file is a program that gmsh runs, and gmsh takes every file without the right first line
for one.  Statements that start commands, touch other files or end the process are refused, and
because some damaged files kill gmsh, each is tried in a process of its own first.
"""

from __future__ import annotations

import importlib
import inspect
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any
from unittest.mock import patch

from nanorom.errors import MeshError, NanoromError

MSH_BEGINS = b"$MeshFormat"
# comments without quotes: those with quotes may not be comments at all, but parts of strings
BLOCK_COMMENT = re.compile(r"/\*[^\"']*?\*/")
LINE_COMMENT = re.compile(r"^([^\"'\n]*?)//[^\"'\n]*$", re.MULTILINE)
FORBIDDEN = re.compile(
    r"\b((?:NonBlocking)?System(?:Call)?|Onelab\w*|Include|Merge\w*|ShapeFromFile|Plugin|Save|Print"
    r"|Exit|Abort)\b(?!\s*[=.])|\b(ExternalProcess|CommandLine|\w*FileName)\b"
    r"|\bPrintf\s*\([^;]*\)\s*(>)"
)
LARGEST_GEO = 10_000_000  # bytes
MEMORY = 2**31, 100  # bytes of address space for a .msh: at least, and per byte of the file
MISSING = (
    "gmsh cannot be loaded ({}); from the Python index it needs libraries that Debian has as "
    "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1"
)
TRIAL = """
import sys
sys.path = [folder for folder in sys.path if folder]  # not where strangers' files are
import resource
try:
    import gmsh
except (ImportError, OSError) as error:
    print("missing", error)
    sys.exit()
file, memory = sys.argv[1], int(sys.argv[2])
if memory:
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
gmsh.initialize(readConfigFiles=False)
gmsh.option.setNumber("General.Terminal", 0)
try:
    gmsh.open(file)
    if len(gmsh.model.mesh.getNodes()[0]) == 0:
        gmsh.model.mesh.generate(2)
    gmsh.model.mesh.getElements()
except Exception as error:  # gmsh raises bare Exception
    print("refused", error)
else:
    print("accepted")
"""


def gmsh() -> Any:
    """The module gmsh; raises NanoromError where it or a library that it needs is missing."""
    try:
        with _own_signals():
            module: Any = importlib.import_module("gmsh")
    except (ImportError, OSError) as error:
        raise NanoromError(MISSING.format(error)) from error
    if not _in_main_thread() and hasattr(module, "oldsig"):
        module.oldsig = None  # what it would set again when it is finalised
    return module


def start() -> Any:
    """The module gmsh, initialised; in any thread, and without a hand on Ctrl-C where it allows so.

    Raises NanoromError where it or a library that it needs is missing.
    """
    module = gmsh()
    takes = inspect.signature(module.initialize).parameters
    # gmsh 4.13 would let Ctrl-C end the process from here on, for good
    own = {"interruptible": False} if "interruptible" in takes else {}
    module.initialize(readConfigFiles=False, **own)
    return module


@contextmanager
def session(told: str) -> Iterator[Any]:
    """The module gmsh, silent, for as long as it is used; one process only.

    Raises MeshError with what was ``told`` and gmsh's last message, NanoromError as `start`.
    """
    module = start()
    try:
        module.option.setNumber("General.Terminal", 0)
        yield module
    except NanoromError:
        raise
    except Exception as error:  # gmsh raises bare Exception
        raise MeshError(f"{told}: {error}") from error
    finally:
        module.finalize()


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _own_signals() -> AbstractContextManager[Any]:
    """gmsh 4.8 sets a signal when it is imported, which Python allows in the main thread alone."""
    if _in_main_thread():
        return nullcontext()
    return patch("signal.signal", return_value=None)


def check(file: Path) -> None:
    """Raise MeshError unless a mesh or geometry file is safe to be read by gmsh.

    Raises NanoromError where gmsh cannot be loaded.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise MeshError(f"{file}: cannot be read: {error.strerror}") from None
    if file.suffix == ".msh":
        if not content.startswith(MSH_BEGINS):
            raise MeshError(f"{file}: not a mesh file of gmsh: it must begin with $MeshFormat")
        smallest, per_byte = MEMORY
        _try(file, max(smallest, per_byte * len(content)))
    else:
        _check_statements(file, content)
        _try(file, 0)


def _check_statements(file: Path, content: bytes) -> None:
    if len(content) > LARGEST_GEO or b"\0" in content:
        raise MeshError(f"{file}: not a geometry file of gmsh: too large, or not text")
    text = content.decode(errors="replace")
    text = BLOCK_COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), text)
    text = LINE_COMMENT.sub(r"\1", text)
    found = FORBIDDEN.search(text)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        what = found[1] or found[2] or "Printf to a file"
        raise MeshError(
            f"{file}: line {line}: found {what}, which is not run: a "
            "geometry file may not start commands, touch other files or stop gmsh"
        )
    if text.rpartition("\n")[2].strip():  # gmsh drops it without a word
        raise MeshError(f"{file}: its last line has no line break, and gmsh would leave it out")


def _try(file: Path, memory: int) -> None:
    # gmsh must not take itself for one of the ranks
    own = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMI", "PRTE_"))}
    command = [sys.executable, "-c", TRIAL, str(file), str(memory)]
    done = subprocess.run(command, env=own, capture_output=True, text=True)
    verdict, _, reason = done.stdout.rpartition("\n")[0].rpartition("\n")[2].partition(" ")
    if verdict == "missing":
        raise NanoromError(MISSING.format(reason))
    if verdict == "refused":
        raise MeshError(f"{file}: gmsh cannot mesh it: {' '.join(reason.split())}")
    if verdict != "accepted":
        raise MeshError(f"{file}: damaged: gmsh dies of it (status {done.returncode})")
