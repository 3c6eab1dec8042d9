"""Start worker processes, which ignore Ctrl-C and do not import the main script of the user.

On Linux, workers are forked from the fork server of `multiprocessing`, which has already imported
`_MODULES`. The command line program starts the fork server first, and then imports its own modules
while the server imports on another core. Therefore, this module must be fast to import.
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
"""Modules that the fork server imports before it forks workers, because most workers need them."""

_ENVIRONMENT = {
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    "PYTHONSAFEPATH": "1",
}
"""Environment variables of workers. Numeric libraries must not start threads, because all cores are
already in use by other workers, and because a process with threads cannot be forked safely.
`PYTHONSAFEPATH` excludes the current folder from the search path of modules."""

HAS_SERVER = sys.platform == "linux"
"""Whether workers are forked from a fork server. On systems other than Linux, some libraries do not
support fork."""


def prepare() -> None:
    """Start the fork server early on Linux, so that workers start fast; skip this on one core."""
    if HAS_SERVER and len(os.sched_getaffinity(0)) > 1:
        start_context()


def start_context() -> ForkServerContext | SpawnContext:
    """Return the `multiprocessing` context for workers, after starting the fork server on Linux."""
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
    """Set `_ENVIRONMENT` in processes that start in the `with` block, and block Ctrl-C in them.

    In this process, Ctrl-C is delayed until the end of the block. Started processes do not import
    the main script, which may lack ``if __name__ == "__main__":``.
    """
    from multiprocessing import resource_tracker

    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    main = sys.modules["__main__"]
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ()) if os.name == "posix" else None
    try:
        os.environ.update(_ENVIRONMENT)
        if mask is not None:
            resource_tracker.ensure_running()  # starting this process later would unblock signals
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
