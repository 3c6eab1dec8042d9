"""Teams of processes of this machine."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from .._memory import usable_memory
from . import teams, template
from .memory import load_psutil, used_by
from .serving import result_of, serve
from .teams import Call, Done, Ending, Failed, Killed, Team, Worker

__all__ = ["LocalTeam", "local_team"]

START_ATTEMPTS = 10
"""In a row, of workers that end before they have begun: several may be killed while they start."""

TICK = 1.0
"""Seconds between looks for a Ctrl-C, which on Windows does not end a wait."""

MEMORY_TICK = 0.1
"""Seconds between looks at the memory of workers."""

MEMORY_SHARE = 0.95
"""Of its share of the memory, what a worker may use before it is ended."""

DEPTH = 2
"""Tasks that a worker has: one at work, and the next, so that it never waits for one."""

_KILL = getattr(signal, "SIGKILL", signal.SIGTERM)  # Windows knows one way


@dataclass(eq=False)
class _Process:
    """A worker, seen from here."""

    connection: Connection
    keeper: BaseProcess | None
    """What started it, if it is no copy of a template."""
    pid: int | None = None
    """None until it has begun."""
    tasks: deque[int] = field(default_factory=deque)
    """Places of calls that it has, the one at work first."""

    def kill(self) -> None:
        """End it, if it has begun."""
        if self.pid is not None:
            with contextlib.suppress(OSError):  # it has ended
                os.kill(self.pid, _KILL)

    def end(self) -> None:
        """End it, and return when it has ended."""
        if self.keeper is not None:
            self.keeper.kill()
        self.kill()
        with contextlib.suppress(EOFError, OSError):
            while True:
                message = self.connection.recv()
                if self.pid is None:
                    self.pid = message
                    self.kill()
        self.forget()

    def forget(self) -> None:
        """Close what belongs to it here; it has ended."""
        self.connection.close()
        if self.keeper is not None:
            self.keeper.join()


class LocalTeam(Team):
    """Processes with equal shares of the memory, each of which does one task at a time.

    Those that end, or use more than their share, are replaced while there is work.
    """

    def __init__(self, n_workers: int, n_threads: int) -> None:
        load_psutil()  # or what is missing would be found out when workers are at work
        memory = usable_memory() / n_workers
        super().__init__([Worker(f"process {n}", n_threads, memory) for n in range(n_workers)])
        self._n_threads = n_threads
        self._template: template.Template | None = None
        self._processes: list[_Process] = []
        self._n_lost_at_start = 0
        self._watch = _MemoryWatch(self._processes, int(MEMORY_SHARE * memory))

    def run(self, calls: Sequence[Call], width: int | None) -> Iterator[tuple[int, Ending]]:
        """As for `Team`: calls begin in their order."""
        waiting = deque(range(len(calls)))
        kills: Counter[int] = Counter()
        n_left = len(calls)
        try:
            while n_left:
                self.restore()
                self._hand_out(waiting, calls, width)
                for process in self._ready():
                    ended = self._take(process, waiting, kills)
                    if ended is not None:
                        n_left -= 1
                        yield ended
        finally:
            for process in [busy for busy in self._processes if busy.tasks]:
                self._processes.remove(process)
                process.end()

    def restore(self) -> None:
        """Start workers that are not there."""
        while len(self._processes) < len(self.workers):
            self._processes.append(self._start())

    def _start(self) -> _Process:
        if not template.CAN_COPY:
            return _spawned(self._n_threads)
        if self._template is None:
            self._template = template.take_prepared()
        try:
            return _Process(self._template.copy(self._n_threads), None)
        except OSError:  # it was killed
            self._template.kill()
            self._template = template.Template()
            return _Process(self._template.copy(self._n_threads), None)

    def _hand_out(self, waiting: deque[int], calls: Sequence[Call], width: int | None) -> None:
        """Give each worker a task, and a second one while there are many."""
        for depth in range(DEPTH if width is None else 1):
            for process in self._processes[:width]:
                n_kept = depth * len(self._processes)  # for whoever is done first
                if len(process.tasks) == depth and len(waiting) > n_kept:
                    place = waiting.popleft()
                    process.tasks.append(place)
                    with contextlib.suppress(OSError):  # it has ended: seen when it is read from
                        process.connection.send((place, pickle.dumps(calls[place])))

    def _ready(self) -> list[_Process]:
        """Workers that have sent something, or have ended."""
        connections = {process.connection: process for process in self._processes}
        return [connections[found] for found in wait(list(connections), TICK)]  # type: ignore[index]

    def _take(
        self, process: _Process, waiting: deque[int], kills: Counter[int]
    ) -> tuple[int, Ending] | None:
        """The place of the call that has ended, and what came of it; None if there is none."""
        try:
            message = process.connection.recv()
        except (EOFError, OSError):
            return self._lost(process, waiting, kills)
        if process.pid is None:
            process.pid = message
            self._n_lost_at_start = 0
            return None
        place, is_done, data = message
        process.tasks.popleft()
        try:
            return place, Done(result_of(is_done, data))
        except Exception as error:
            return place, Failed(error)

    def _lost(
        self, process: _Process, waiting: deque[int], kills: Counter[int]
    ) -> tuple[int, Ending] | None:
        """Take the tasks of a worker that has ended back, and count that against the first."""
        self._processes.remove(process)
        process.forget()
        waiting.extendleft(reversed(process.tasks))
        if process.pid is None:
            self._check_start(process)
            return None
        if not process.tasks:
            return None
        place = process.tasks[0]
        kills[place] += 1
        if kills[place] <= teams.ALLOWED_KILLS:
            return None
        waiting.popleft()
        return place, Killed(kills[place])

    def _check_start(self, process: _Process) -> None:
        """Raise a ConnectionError where workers end before they have begun, again and again."""
        self._n_lost_at_start += 1
        if process.keeper is not None and process.keeper.exitcode == 1:
            raise ConnectionError(
                "the workers cannot be started: a script that calls batch has to do so below"
                " if __name__ == '__main__':"
            )
        if self._processes:
            time.sleep(MEMORY_TICK)  # the others go on: there may be no room for more at the moment
        elif self._n_lost_at_start >= START_ATTEMPTS:
            raise ConnectionError("the workers cannot be started: each ended before it began")

    def close(self) -> None:
        """End all processes."""
        self._watch.stop()
        if self._template is not None and any(lacks.pid is None for lacks in self._processes):
            self._template.kill()  # or those would begin now
        for process in self._processes:
            process.kill()
        while self._processes:
            self._processes.pop().end()
        if self._template is not None:
            self._template.close()


@contextlib.contextmanager
def local_team(n_workers: int, n_threads: int = 1) -> Iterator[LocalTeam]:
    """Start processes with equal shares of the memory; they end with the context, or with us.

    Raises
    ------
    MissingExtraError
        If psutil is not installed.
    """
    team = LocalTeam(n_workers, n_threads)
    try:
        team.restore()
        yield team
    finally:
        team.close()


def _spawned(n_threads: int) -> _Process:
    """A new process, which imports everything itself."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    keeper = context.Process(target=serve, args=(theirs, n_threads), daemon=True)
    if os.name == "posix":
        resource_tracker.ensure_running()  # or the first process would, and unblock signals
    with template.deaf_to_interrupts():
        keeper.start()
    theirs.close()
    return _Process(ours, keeper)


class _MemoryWatch:
    """Ends workers that use more memory than they may, in a thread of its own."""

    def __init__(self, processes: Sequence[_Process], limit: int) -> None:
        self._processes = processes
        self._limit = limit
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._is_over.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._is_over.wait(MEMORY_TICK):
            for process in list(self._processes):
                if process.pid is not None and used_by(process.pid) > self._limit:
                    process.kill()
