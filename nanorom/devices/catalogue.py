"""Devices that were computed, each once: by processes that wait, kept for a run that goes on.

Threads ask for them; an answer that was given before, in this run or in one that was interrupted,
is given again, so that a search which is begun anew comes to where it was.
"""

from __future__ import annotations

import hashlib
import json
import queue
import threading
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any

from nanorom.devices import workers
from nanorom.devices.workers import Worker
from nanorom.files.lines import Lines

Answer = dict[str, Any]


class Stopped(Exception):
    """No further device is begun; the message says why."""


class Catalogue:
    """Quantities of devices, by their tables. To be used in a ``with``, which ends its processes.

    Parameters
    ----------
    names : of quantities
    directory : of the scenes' files
    kept : where answers are kept
    processes : that work at once; seconds : that one device may take; hours : after which no
        further one is begun
    module : that a process runs, that of `workers` if left out
    """

    def __init__(
        self,
        names: Sequence[str],
        directory: Path,
        kept: Lines,
        processes: int,
        seconds: float,
        hours: float,
        module: str = "",
    ) -> None:
        self._names, self._directory = list(names), str(directory.resolve())
        self._module = module or workers.MODULE
        self._kept, self._seconds = kept, seconds
        self._until, self._hours = time.monotonic() + 3600 * hours, hours
        self._threads = ThreadPoolExecutor(processes)
        self._idle: queue.SimpleQueue[Worker | None] = queue.SimpleQueue()
        for _ in range(processes):
            self._idle.put(None)
        self._busy, self._lock = set[Worker](), threading.Lock()
        self._asked: dict[int, Future[Answer]] = {}
        self._ended = ""
        self.computed = 0

    def __enter__(self) -> Catalogue:
        return self

    def __exit__(self, kind: type | None, error: Any, trace: TracebackType | None) -> None:
        self.stop("interrupted")
        self._threads.shutdown(cancel_futures=True)
        while not self._idle.empty():
            worker = self._idle.get()
            if worker is not None:
                worker.kill()

    def stop(self, why: str) -> None:
        """Begin no more devices, and end those that are under way."""
        with self._lock:
            self._ended = self._ended or why
            busy = list(self._busy)
        for worker in busy:
            worker.process.kill()

    def at(self, tables: Answer, slopes: bool = False) -> Answer:
        """What a device has: values by name, units and derivatives, or a failure.

        Raises Stopped if it was never computed and none is begun any more.
        """
        return _result(self._future(tables, slopes))

    def each(self, tables: Iterable[Answer]) -> list[Answer]:
        """Of several devices at once; raises Stopped."""
        return [_result(future) for future in [self._future(own, False) for own in tables]]

    def _future(self, tables: Answer, slopes: bool) -> Future[Answer]:
        job = {"scene": tables, "directory": self._directory, "of": self._names, "slopes": slopes}
        digest = hashlib.sha256(json.dumps(job, sort_keys=True, default=str).encode()).hexdigest()
        number = int(digest[:15], 16)
        with self._lock:
            if number not in self._asked:
                self._asked[number] = self._threads.submit(self._found, number, job)
            return self._asked[number]

    def _found(self, number: int, job: Answer) -> Answer:
        known = self._kept.found.get(number)
        if known is not None and "failure" not in known:
            return known
        if not self._ended and time.monotonic() > self._until:
            self._ended = f"after {self._hours:g} h (hours)"
        if self._ended:
            raise Stopped(self._ended)
        worker = self._idle.get() or Worker.begin(self._module)
        with self._lock:
            self._busy.add(worker)
        try:
            found = worker.ask(job, self._seconds)
        finally:
            with self._lock:
                self._busy.discard(worker)
            dead = worker.dead
            if dead:
                worker.kill()
            self._idle.put(None if dead else worker)
        if self._ended == "interrupted":
            raise Stopped(self._ended)
        with self._lock:
            self.computed += 1
            self._kept.keep(number, found)
        return found


def _result(future: Future[Answer]) -> Answer:
    try:
        return future.result()
    except CancelledError:
        raise Stopped("interrupted") from None
