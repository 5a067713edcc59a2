"""Jobs in processes of their own: one that dies, or takes too long, costs its own job alone."""

from __future__ import annotations

import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from typing import Any

import attrs

MODULE = "nanorom.devices.worker"
PIECE = 65536  # bytes of an answer that are read at once
Job = tuple[int, dict[str, Any]]  # number, what is asked


@attrs.define(eq=False)
class Worker:
    """A process, and the job that it has."""

    process: subprocess.Popen[bytes]
    number: int = -1
    began: float = 0.0
    answered: bytes = b""

    @classmethod
    def begin(cls, module: str) -> Worker:
        """A process that waits for a job."""
        command = [sys.executable, "-m", module]
        # as this process found the package; at a prompt "" is the folder it is in
        search = os.pathsep.join(path or os.getcwd() for path in sys.path)
        return cls(
            subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": search},
            )
        )

    def take(self, job: Job) -> None:
        """Begin a job."""
        self.number, asked = job
        self.began, self.answered = time.monotonic(), b""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(asked).encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:  # it died; its answer, which is none, tells
            pass

    def listen(self) -> dict[str, Any] | None:
        """Its answer as far as there is one; of a process that died, why there is none."""
        assert self.process.stdout is not None
        piece = os.read(self.process.stdout.fileno(), PIECE)
        self.answered += piece
        if self.answered.endswith(b"\n"):
            found: dict[str, Any] = json.loads(self.answered)
            return found
        return None if piece else {"failure": self._end()}

    def ask(self, asked: dict[str, Any], seconds: float) -> dict[str, Any]:
        """The answer to one job, waited for; what takes longer is ended and answered so."""
        self.take((0, asked))
        assert self.process.stdout is not None
        with selectors.DefaultSelector() as pipe:
            pipe.register(self.process.stdout, selectors.EVENT_READ)
            while (left := self.began + seconds - time.monotonic()) > 0:
                found = self.listen() if pipe.select(left) else None
                if found is not None:
                    return found
        self.kill()
        return too_long(seconds)

    def _end(self) -> str:
        status = self.process.wait()
        if status >= 0:
            return f"its process ended with status {status}"
        name = signal.Signals(-status).name
        return f"its process was ended by {name}, perhaps for want of memory"

    @property
    def dead(self) -> bool:
        """Whether it takes no more jobs."""
        return self.process.poll() is not None

    def kill(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except BrokenPipeError:  # a job that it did not read any more
                    pass


def each(
    jobs: Iterable[Job], processes: int, seconds: float, module: str = MODULE
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Answers to jobs as they come, with their numbers.

    A job that takes longer than seconds, or whose process dies, is answered by its "failure".
    module: that a process runs; it answers lines with lines.
    """
    waiting, workers = iter(jobs), list[Worker]()
    with selectors.DefaultSelector() as pipes:
        try:
            for job in waiting:
                _employ(Worker.begin(module), workers, pipes, job)
                if len(workers) == processes:
                    break
            while workers:
                for worker, found in _answers(pipes, workers, seconds):
                    yield worker.number, found
                    more = next(waiting, None)
                    if worker.dead or more is None:
                        pipes.unregister(worker.process.stdout)  # type: ignore[arg-type]
                        workers.remove(worker)
                        worker.kill()
                        if more is not None:
                            _employ(Worker.begin(module), workers, pipes, more)
                    else:
                        worker.take(more)
        finally:
            for worker in workers:
                worker.kill()


def _employ(worker: Worker, workers: list[Worker], pipes: selectors.BaseSelector, job: Job) -> None:
    workers.append(worker)
    pipes.register(worker.process.stdout, selectors.EVENT_READ, worker)  # type: ignore[arg-type]
    worker.take(job)


def _answers(
    pipes: selectors.BaseSelector, workers: list[Worker], seconds: float
) -> Iterator[tuple[Worker, dict[str, Any]]]:
    """Waits for the next answers; who has none in time is ended."""
    left = min(worker.began for worker in workers) + seconds - time.monotonic()
    for key, _ in pipes.select(max(left, 0.0)):
        found = key.data.listen()
        if found is not None:
            yield key.data, found
    late = [worker for worker in workers if time.monotonic() - worker.began > seconds]
    for worker in late:
        worker.process.kill()
        worker.process.wait()
        yield worker, too_long(seconds)


def too_long(seconds: float) -> dict[str, Any]:
    """The answer to a job that took longer."""
    return {"failure": f"took more than {seconds:g} s (seconds)"}
