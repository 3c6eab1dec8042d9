"""Start of worker processes: no user code, no Ctrl-C, imports done once.

On Linux they are forked from the fork server of `multiprocessing`, which has imported the modules
of `_MODULES`. This module is quick to import: the command starts the fork server first, and then
imports its own modules while the server imports them on another core.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import types
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

_MODULES = [
    "superfacets.batches.jobs", "superfacets.io.readers.read", "superfacets.pipeline", "psutil",
    "superfacets.workers.child",
]  # fmt: skip
"""Modules that nearly every worker imports."""

_ENVIRONMENT = {
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    "PYTHONSAFEPATH": "1",
}
"""Environment of workers. Numeric libraries start no threads: each worker has its own share of the
cores, and a process with threads cannot be forked. With `PYTHONSAFEPATH`, the current folder is not
searched for modules."""


HAS_SERVER = sys.platform == "linux"
"""On other systems, system libraries may not survive a fork."""


def prepare() -> None:
    """Start the fork server early, if the system has one and another core is free."""
    if HAS_SERVER and len(os.sched_getaffinity(0)) > 1:
        start_context()


def start_context() -> ForkServerContext | SpawnContext:
    """The start method of this system; its helper processes are running."""
    import multiprocessing

    if not HAS_SERVER:
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_MODULES)
    with own_settings():
        forkserver.ensure_running()
    return context


@contextlib.contextmanager
def own_settings() -> Iterator[None]:
    """Start processes with another environment, and with Ctrl-C blocked.

    The terminal sends Ctrl-C to all processes; here it is delayed until the end of the block.
    Workers do not import the running script, which may lack ``if __name__ == "__main__":``.
    """
    from multiprocessing import resource_tracker

    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    main = sys.modules["__main__"]
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ()) if os.name == "posix" else None
    try:
        os.environ.update(_ENVIRONMENT)
        if mask is not None:
            resource_tracker.ensure_running()  # or the first process would, and unblock signals
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        sys.modules["__main__"] = types.ModuleType("__main__")
        yield
    finally:
        sys.modules["__main__"] = main
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
