"""Two levels of parallel work: ranks of a group share a mesh, groups share what is independent.

Classes of symmetry and static load cases do not wait for each other.  Every group has the whole
mesh, in the same parts: the ranks with the same number in all groups hold the same degrees of
freedom, and across them one group's results become everybody's.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from pathlib import Path
from typing import TypeVar

import attrs
import numpy as np
from mpi4py import MPI

from nanorom.errors import NanoromError, SolverError

LEAST_BYTES = 1e4  # per unknown of a deflection: with multigrid, at a million of them
LITTLE = 2**28  # bytes, what every run takes with its libraries: not worth asking the system

Item = TypeVar("Item", bound=Hashable)
Result = TypeVar("Result")


@attrs.frozen
class Team:
    """Ranks within a group, which share a mesh, and across: those of one number in all groups."""

    within: MPI.Comm
    across: MPI.Comm


def split(comm: MPI.Comm, groups: int) -> Team:
    """Deal ranks out to groups. Collective; raises NanoromError if that does not come out even."""
    if groups < 1 or comm.size % groups:
        raise NanoromError(
            f"--groups: found {groups} with {comm.size} ranks; allowed: a number that divides that "
            "of the ranks (mpirun -n)"
        )
    if groups == 1:
        return Team(comm, MPI.COMM_SELF)
    size = comm.size // groups
    return Team(comm.Split(comm.rank // size), comm.Split(comm.rank % size))


def alone() -> Team:
    """A team of this rank only, which has a mesh for itself."""
    return Team(MPI.COMM_SELF, MPI.COMM_SELF)


def together() -> MPI.Comm:
    """All ranks that were started together."""
    return MPI.COMM_WORLD


def memory(comm: MPI.Comm) -> float:
    """Bytes that new processes may take where least are left; 0 if unknown. Collective.

    Of the ranks' machines, and of the limits that a queue or a container sets them.
    """
    try:
        words = Path("/proc/meminfo").read_text().split()
        free = 1024.0 * int(words[words.index("MemAvailable:") + 1])
        free = min(free, left_by_limits())
    except (OSError, ValueError):  # not Linux
        free = 0.0
    return float(comm.allreduce(free, op=MPI.MIN))


def check_fits(unknowns: int, comm: MPI.Comm) -> None:
    """Raise SolverError if deflections with so many unknowns need more memory than is left.

    A run that the system kills tells nothing.  Collective.
    """
    needed = LEAST_BYTES * unknowns
    if needed < LITTLE:
        return
    left = memory(comm)
    if 0 < left < needed:
        raise SolverError(
            f"a mesh with {unknowns} unknowns of the deflection needs {needed / 2**30:.3g} GB or "
            f"more, and {left / 2**30:.3g} GB of memory are left; ask for a larger tolerance or "
            "fewer modes"
        )


def left_by_limits(
    own: Path = Path("/proc/self/cgroup"), root: Path = Path("/sys/fs/cgroup")
) -> float:
    """Bytes that the control groups of this process leave it, those above it included."""
    files = {"": ("memory.max", "memory.current")}  # of version 2; "memory" is version 1
    files["memory"] = "memory.limit_in_bytes", "memory.usage_in_bytes"
    least = np.inf
    for line in own.read_text().splitlines() if own.is_file() else []:
        _, controllers, place = line.split(":", 2)
        for controller in set(controllers.split(",")) & set(files):
            folder = root / controller / place.lstrip("/")
            for above in (folder, *folder.parents):
                limit, used = (above / name for name in files[controller])
                if limit.is_file() and used.is_file() and limit.read_text().strip() != "max":
                    least = min(least, float(limit.read_text()) - float(used.read_text()))
    return max(least, 0.0)


def shared(
    across: MPI.Comm,
    items: Sequence[Item],
    work: Callable[[Sequence[Item]], dict[Item, Result]],
    cost: Callable[[Item], float] = lambda _: 1.0,
) -> dict[Item, Result]:
    """Results of all items, each of which one group works on. Collective.

    ``work`` gives the results of some of the items; what it raises in one group is raised in all.
    ``cost`` tells how long an item takes beside the others.
    """
    if across.size == 1:
        return work(items)
    own = dealt(items, across.size, cost)[across.rank]
    found: dict[Item, Result] = {}
    error = None
    try:
        found = work(own) if own else {}
    except NanoromError as raised:
        error = raised
    everything: dict[Item, Result] = {}
    for part, raised_there in across.allgather((found, error)):
        if raised_there is not None:
            raise raised_there
        everything |= part
    return {item: everything[item] for item in items}


def dealt(items: Sequence[Item], shares: int, cost: Callable[[Item], float]) -> list[list[Item]]:
    """Items in shares of about equal cost: the dearest first, each to who has least so far."""
    found: list[list[Item]] = [[] for _ in range(shares)]
    total = [0.0] * shares
    for item in sorted(items, key=cost, reverse=True):
        least = total.index(min(total))
        found[least].append(item)
        total[least] += cost(item)
    return found


def check_alike(across: MPI.Comm, array: np.ndarray) -> None:
    """Raise SolverError unless an array is the same in all groups. Collective."""
    if len(set(across.allgather(array.tobytes()))) > 1:
        raise SolverError(
            "--groups: the mesh was cut differently in two groups; use groups of one rank each"
        )
