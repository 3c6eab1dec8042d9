"""A Dask cluster as users start it: a scheduler, and workers with different thread counts."""

import contextlib
import json
import subprocess
import sys
import time

import pytest

distributed = pytest.importorskip("distributed")

LOOPBACK = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file"]


class Cluster:
    """A scheduler and two workers with one and two threads, each in a separate process."""

    def __init__(self, folder):
        file = folder / "scheduler.json"
        self.processes = []
        self._start(folder, "scheduler", *LOOPBACK, str(file), "--port", "0")
        self.address = _wait_for(lambda: json.loads(file.read_text())["address"])
        for n_threads in ("1", "2"):
            self._start(folder, "worker", *LOOPBACK, str(file), "--nthreads", n_threads,
                        "--no-nanny", "--local-directory", str(folder))  # fmt: skip
        with distributed.Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)

    def _start(self, folder, *words):
        command = [sys.executable, "-m", "dask", *words]
        # Processes run in another folder, where relative paths would be wrong.
        self.processes.append(subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL))

    def kill(self, *places):
        for place in places:
            self.processes[place].kill()
            self.processes[place].wait()


def _wait_for(look):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError, ValueError):
            return look()
        time.sleep(0.02)
    raise TimeoutError


@contextlib.contextmanager
def started(folder):
    there = Cluster(folder)
    try:
        yield there
    finally:
        there.kill(2, 1, 0)
