"""Wall time by stage, and progress."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from nanorom.types import Progress


class Stopwatch:
    """Wall time by stage, and the caller told when a stage begins."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time what happens inside."""
        self.tell(name, 0, 1)
        start = time.perf_counter()
        yield
        # of all meshes together: a stage comes again on every one
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
        self.tell(name, 1, 1)

    def apart(self) -> Stopwatch:
        """Another one that tells the same caller: for a computation within a stage."""
        return Stopwatch(self._progress)

    def tell(self, name: str, done: int, total: int) -> None:
        """Report progress within a stage."""
        if self._progress is not None:
            self._progress(name, done, total)
