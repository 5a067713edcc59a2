"""A first reading of a stranger's HDF5 file by a process that may be lost.

The HDF5 library is not made for bytes from strangers: one that is changed may crash it, or make it
allocate without bound or run for ever.  So a process of its own, with bounds on its memory and
time, reads everything once; what it survives is read here.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from nanorom.errors import FileError

MEMORY = 2**30  # bytes that reading may take beyond what Python and its libraries do
SECONDS = 60  # of processor time
PER_BYTE = 100  # bytes of a dataset per byte of its file; more is not compression, but a trap
SMALL = 2**26  # bytes of a dataset that are read in any case

# what goes wrong in an orderly way is found again, and told, by who reads the file in earnest
PROGRAM = f"""
import sys
sys.path = [folder for folder in sys.path if folder]  # not where strangers' files are
import math, os, resource
import h5py
pages = int(open("/proc/self/statm").read().split()[0]) if sys.platform == "linux" else 2**18
most = pages * resource.getpagesize() + max({MEMORY}, {PER_BYTE} * int(sys.argv[2]))
resource.setrlimit(resource.RLIMIT_AS, (most, most))
resource.setrlimit(resource.RLIMIT_CPU, ({SECONDS}, {SECONDS}))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

def look(name, item):
    for key in item.attrs:
        item.attrs[key]
    if isinstance(item, h5py.Dataset) and item.external is None and not item.is_virtual:
        chunk = math.prod(item.chunks or ()) * item.dtype.itemsize
        if max(item.nbytes, chunk) <= max({SMALL}, {PER_BYTE} * int(sys.argv[2])):
            item[()]

try:
    with h5py.File(sys.argv[1], "r") as file:
        look("/", file)
        file.visititems(look)
except MemoryError:
    os.abort()
except Exception:
    pass
"""

_survived: set[tuple[int, ...]] = set()


def survive(path: Path) -> None:
    """Raise FileError if the HDF5 library does not survive to read all of a file.

    A file is tried once by a process, and none that it has written itself.
    """
    mark = _mark(path)
    if mark in _survived:
        return
    # h5py has another build for processes of MPI: this is none
    plain = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMI", "PRTE_"))}
    tried = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(path), str(path.stat().st_size)],
        env=plain,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    )
    if tried.returncode < 0:
        raise FileError("damaged: the HDF5 library crashes on it, or never ends")
    _survived.add(mark)


def trust(path: Path) -> None:
    """Take a file as it is now for one that this process has written."""
    _survived.add(_mark(path))


def _mark(path: Path) -> tuple[int, ...]:
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
