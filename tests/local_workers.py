"""Find the worker processes that a batch, a tiled run or a study has started on this machine."""

import contextlib

import pytest

SERVER = "multiprocessing.forkserver"


def worker_processes():
    """Return the descendants of this process that run calls."""
    return [child for child in _children() if not _is_server(child)]


def servers():
    """Return the fork servers of workers."""
    return [child for child in _children() if _is_server(child)]


def _children():
    psutil = pytest.importorskip("psutil")
    found = []
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):  # a process that was just killed
            if child.status() != psutil.STATUS_ZOMBIE and _is_ours(child):
                found.append(child)
    return found


def _is_ours(process):
    command = " ".join(process.cmdline())
    return SERVER in command or "spawn_main" in command


def _is_server(process):
    """Return whether a process is a fork server, not a fork, which has the same command."""
    psutil = pytest.importorskip("psutil")
    with contextlib.suppress(psutil.Error):
        if SERVER not in " ".join(process.cmdline()):
            return False
        parent = process.parent()
        return parent is None or SERVER not in " ".join(parent.cmdline())
    return False
