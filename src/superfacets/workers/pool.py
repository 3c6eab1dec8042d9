"""Define `Pool`, a team of worker processes on this machine."""

from __future__ import annotations

import contextlib
import math
import pickle
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from multiprocessing.connection import wait

from .._memory import usable_memory
from ..errors import MissingExtraError
from . import calls as limits
from .calls import Call, Done, Ending, Failed, Killed, Team, Worker
from .child import serve
from .start import own_settings, start_context

START_ATTEMPTS = 10
"""Number of consecutive workers that die before they are ready, after which a pool gives up."""

TICK = 1.0
"""Interval between checks for Ctrl-C, in seconds. Checks are needed because Ctrl-C does not
interrupt `wait` on Windows."""

PAUSE = 0.1
"""Time to wait before a worker that died at its start is replaced, in seconds."""

MEMORY_SHARE = 0.95
"""Fraction of `Worker.memory` above which a worker process ends itself."""

DEPTH = 2
"""Maximum number of calls that a worker holds at a time: the running call and the next call."""

Admits = Callable[[int, Sequence[int]], bool]
"""Function that returns whether a call may run at the same time as other calls. Its arguments are
the index of the call and the indices of the other calls."""


class _Process:
    def __init__(self, n_threads: int, memory: float) -> None:
        context = start_context()
        self.connection, theirs = context.Pipe()
        self.places: deque[int] = deque()  # indices of the running call and of waiting calls
        self.has_begun = False  # whether the process has started and can run calls
        arguments = (theirs, n_threads, memory)
        self._process = context.Process(target=serve, args=arguments, daemon=True)
        # Errors are ignored here, because the next read from the connection fails if the process
        # was not started.
        with theirs, own_settings(), contextlib.suppress(OSError, EOFError):
            self._process.start()

    def give(self, place: int, call: Call) -> None:
        self.places.append(place)
        with contextlib.suppress(OSError):  # the next read fails if the process has died
            self.connection.send_bytes(pickle.dumps(call))

    def end(self) -> None:
        self.connection.close()
        if self._process.pid is not None:
            self._process.kill()
            self._process.join()


class Pool(Team):
    """A team of processes on this machine. Each process runs one call at a time.

    Each process may use an equal part of `memory`, in bytes. A process that ends or uses more
    memory is replaced as long as there are calls. If `memory` is infinite, the memory of processes
    is not checked. `allowed_kills` replaces the constant `ALLOWED_KILLS`.
    """

    def __init__(self, n_workers: int, n_threads: int, memory: float, allowed_kills: int) -> None:
        share = memory / n_workers
        super().__init__([Worker(f"process {n}", n_threads, share) for n in range(n_workers)])
        self._allowed_kills = allowed_kills
        self._processes: list[_Process] = []
        self._n_lost_at_start = 0

    def run(
        self, calls: Sequence[Call], width: int | None = None, admits: Admits | None = None
    ) -> Iterator[tuple[int, Ending]]:
        """Run calls in order, like `Team.run`; a call waits as long as `admits` returns False."""
        waiting = deque(range(len(calls)))
        kills: Counter[int] = Counter()
        n_left = len(calls)
        try:
            while n_left:
                while len(self._processes) < min(n_left, len(self.workers)):
                    worker = self.workers[0]
                    process = _Process(worker.n_threads, MEMORY_SHARE * worker.memory)
                    self._processes.append(process)
                self._assign_calls(waiting, calls, width, admits)
                ready = wait([process.connection for process in self._processes], TICK)
                for process in [one for one in self._processes if one.connection in ready]:
                    ended = self._receive(process, waiting, kills)
                    if ended is not None:
                        n_left -= 1
                        yield ended
        finally:
            for process in [busy for busy in self._processes if busy.places]:
                self._processes.remove(process)
                process.end()

    def _assign_calls(
        self, waiting: deque[int], calls: Sequence[Call], width: int | None, admits: Admits | None
    ) -> None:
        """Give each idle worker a call, and each worker a second call if enough calls are waiting.

        With `width` or `admits`, no worker gets a second call.
        """
        is_limited = width is not None or admits is not None
        for depth in range(1 if is_limited else DEPTH):
            for process in self._processes[:width]:
                n_kept = depth * len(self._processes)  # calls kept for workers that finish early
                if len(process.places) > depth or len(waiting) <= n_kept:
                    continue
                at_work = [place for other in self._processes for place in other.places]
                fits = (place for place in waiting if admits is None or admits(place, at_work))
                if (place := next(fits, None)) is not None:
                    waiting.remove(place)
                    process.give(place, calls[place])

    def _receive(
        self, process: _Process, waiting: deque[int], kills: Counter[int]
    ) -> tuple[int, Ending] | None:
        """Read a message from a worker; return (index, result) if it is the end of a call."""
        try:
            message = process.connection.recv()
        except (EOFError, OSError):
            return self._lost(process, waiting, kills)
        if message is None:
            process.has_begun = True
            self._n_lost_at_start = 0
            return None
        has_returned, data = message
        place = process.places.popleft()
        try:
            value = pickle.loads(data)
        except Exception as error:
            return place, Failed(error)
        return place, Done(value) if has_returned else Failed(value)

    def _lost(
        self, process: _Process, waiting: deque[int], kills: Counter[int]
    ) -> tuple[int, Ending] | None:
        """Requeue the calls of a worker whose process has ended.

        If too many workers have died while running the same call, the call is removed from the
        queue, and returned as (index, `Killed`).
        """
        self._processes.remove(process)
        process.end()
        waiting.extendleft(reversed(process.places))
        if not process.has_begun:
            self._check_start()
            return None
        if not process.places:
            return None
        place = process.places[0]
        kills[place] += 1
        if kills[place] <= self._allowed_kills:
            return None
        return waiting.popleft(), Killed(kills[place])

    def _check_start(self) -> None:
        """Count a worker that died at its start; wait, or raise a ConnectionError if none is left.

        The error is raised only after `START_ATTEMPTS` consecutive deaths.
        """
        self._n_lost_at_start += 1
        if self._processes:
            time.sleep(PAUSE)  # other workers may free memory
        elif self._n_lost_at_start >= START_ATTEMPTS:
            raise ConnectionError(
                f"worker processes cannot be started: {self._n_lost_at_start} of them died before"
                " they were ready (out of memory?)"
            )

    def close(self) -> None:
        """Kill all processes."""
        while self._processes:
            self._processes.pop().end()


@contextlib.contextmanager
def open_pool(
    n_workers: int,
    n_threads: int = 1,
    memory: float | None = None,
    allowed_kills: int | None = None,
) -> Iterator[Pool]:
    """Yield a `Pool`, whose processes end after the `with` block, or when this process ends.

    The parameters are the same as in `Pool`. By default, the processes may together use the memory
    of this machine (see `usable_memory`). Raises a MissingExtraError if memory is limited and
    psutil is not installed.
    """
    memory = usable_memory() if memory is None else memory
    if memory < math.inf and find_spec("psutil") is None:
        raise MissingExtraError("several worker processes", "batch")
    kills = limits.ALLOWED_KILLS if allowed_kills is None else allowed_kills
    pool = Pool(n_workers, n_threads, memory, kills)
    try:
        yield pool
    finally:
        pool.close()
