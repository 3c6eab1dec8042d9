"""Find the worker processes that a batch or a study has started on this machine."""

import contextlib

import pytest


def worker_processes():
    """Return the descendants of this process that run calls."""
    psutil = pytest.importorskip("psutil")
    found = []
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):  # a process that was just killed
            is_worker = "spawn_main" in " ".join(child.cmdline())
            if is_worker and child.status() != psutil.STATUS_ZOMBIE:
                found.append(child)
    return found
