"""The C compiler of this machine: where it is, what its processor can, small libraries made by it.

Source of the libraries' cache: XDG Base Directory Specification.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

CPU_INFO = Path("/proc/cpuinfo")  # Linux'
VECTORS = {"avx2": "-mavx2", "fma": "-mfma"}  # names in it, and the compiler's options
LONGEST = 120.0  # s that a small library may take on a busy machine


def instructions() -> list[str]:
    """Options for vectors of four numbers, where this processor has them; whoever keeps what is
    compiled keeps it by its options, so that other processors may share the place.
    """
    try:
        told = set(CPU_INFO.read_text(encoding="ascii", errors="replace").split())
    except OSError:  # not Linux: compiled for any processor
        return []
    return list(VECTORS.values()) if VECTORS.keys() <= told else []


def zig() -> str | None:
    """Zig's compiler (``pip install ziglang``), where it is and there is no other one."""
    if _usual() is not None or importlib.util.find_spec("ziglang") is None:
        return None
    return f"{shlex.quote(sys.executable)} -m ziglang cc"


def _usual() -> str | None:
    """The compiler that CC names, or that this Python was made with."""
    named = os.environ.get("CC")
    if named:
        return named
    own = (sysconfig.get_config_var("CC") or "cc").split()[0]
    return own if shutil.which(own) else None


@cache
def library(source: Path) -> ctypes.CDLL | None:
    """The shared library of a C file, compiled once for this processor and kept; None where there
    is no compiler, or where it fails: callers have another way.
    """
    command = _usual() or zig()
    if command is None:
        return None
    options = ["-O3", "-shared", "-fPIC", *instructions()]
    text = source.read_bytes() + repr((command, options)).encode()
    name = f"{source.stem}-{hashlib.sha256(text).hexdigest()[:16]}.so"
    for folder in _folders():
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            if not (folder / name).exists():
                _compile([*shlex.split(command), *options], source, folder / name)
            return ctypes.CDLL(str(folder / name))
        except (OSError, subprocess.SubprocessError):  # not writable, or no compiler that works
            continue
    return None


def _folders() -> Iterator[Path]:
    """Where libraries may be kept: of the user, else for this process alone."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    yield Path(home) / "nanorom"
    yield Path(tempfile.mkdtemp(prefix="nanorom-"))


def _compile(command: list[str], source: Path, target: Path) -> None:
    """Under another name first: other processes see the whole library or none."""
    handle, name = tempfile.mkstemp(dir=target.parent, suffix=".so")
    os.close(handle)
    try:
        line = [*command, str(source), "-o", name, "-lm"]
        subprocess.run(line, check=True, capture_output=True, timeout=LONGEST)
        os.replace(name, target)
    finally:
        Path(name).unlink(missing_ok=True)
