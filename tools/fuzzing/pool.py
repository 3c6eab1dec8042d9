"""Processes that run cases one by one, within limits of time and memory."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import IO

MEMORY_LIMIT = 4 << 30
"""Bytes of address space: cases are small, so more is an amplification."""


class Worker:
    """A process that runs cases; a new one is started where it dies or hangs."""

    def __init__(self, command: list[str], seconds_per_case: float) -> None:
        self._command = command
        self._limit = seconds_per_case
        self._start()

    def run(self, number: int) -> str | None:
        """Run a case; return what is wrong with it, if anything is."""
        with contextlib.suppress(BrokenPipeError):  # it died: seen below
            self._stdin.write(f"{number}\n")
            self._stdin.flush()
        if not select.select([self._stdout], [], [], self._limit)[0]:
            return self._restart(f"it did not end within {self._limit:g} seconds")
        answer = self._stdout.readline()
        if not answer:
            return self._restart(f"the process ended with status {self._process.wait()}")
        failure: str | None = json.loads(answer)
        return failure

    def stop(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._errors.close()

    def _start(self) -> None:
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 - closed by stop
        self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            text=True,
        )  # fmt: skip
        assert self._process.stdin
        assert self._process.stdout
        self._stdin: IO[str] = self._process.stdin
        self._stdout: IO[str] = self._process.stdout

    def _restart(self, reason: str) -> str:
        self._process.kill()
        self._process.wait()
        self._errors.seek(0)
        failure = f"{reason}\n{self._errors.read()[-4000:]}"
        self.stop()
        self._start()
        return failure


def serve(run: Callable[[int], str | None]) -> None:
    """Be such a process: answer each number on standard input by a line of JSON."""
    limit_memory()
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        print(json.dumps(run(int(line))), file=answers, flush=True)


def limit_memory() -> None:
    """Let what takes far too much memory fail, where the system can."""
    with contextlib.suppress(ImportError):  # Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
