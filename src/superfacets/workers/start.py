"""Start worker processes, which do not import the user's main script and ignore Ctrl-C.

On Linux, workers are forked from the fork server of `multiprocessing`, which has already imported
`_MODULES`. The command line program starts the fork server first, and then imports its own modules
while the server imports on another core. Therefore this module must be fast to import.
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
"""Modules that the fork server imports, because most workers need them."""

_ENVIRONMENT = {
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    "PYTHONSAFEPATH": "1",
}
"""Environment variables of workers. Numeric libraries must not start threads, because workers share
the cores, and because a process with threads cannot be forked safely. `PYTHONSAFEPATH` excludes the
current folder from the search for modules."""

HAS_SERVER = sys.platform == "linux"
"""Whether workers are forked from a server. Some libraries of other systems do not support fork."""


def prepare() -> None:
    """Start the fork server early if there are several cores."""
    if HAS_SERVER and len(os.sched_getaffinity(0)) > 1:
        start_context()


def start_context() -> ForkServerContext | SpawnContext:
    """Return the `multiprocessing` context for workers; start the fork server if there is one."""
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
    """Within the block, start processes with `_ENVIRONMENT` and with Ctrl-C blocked.

    Ctrl-C in this process is delayed until the end of the block. Started processes do not import
    the main script, which may lack ``if __name__ == "__main__":``.
    """
    from multiprocessing import resource_tracker

    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    main = sys.modules["__main__"]
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ()) if os.name == "posix" else None
    try:
        os.environ.update(_ENVIRONMENT)
        if mask is not None:
            resource_tracker.ensure_running()  # its later start would unblock signals
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
