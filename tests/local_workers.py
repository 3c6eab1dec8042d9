"""The worker processes that a batch, a run in tiles or a study has started on this machine."""

import contextlib

import pytest

SERVER = "multiprocessing.forkserver"


def worker_processes():
    """Processes below us that make calls."""
    return [child for child in _children() if not _is_server(child)]


def servers():
    """Processes that workers are forked from."""
    return [child for child in _children() if _is_server(child)]


def _children():
    psutil = pytest.importorskip("psutil")
    found = []
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):  # one that was killed a moment ago
            if child.status() != psutil.STATUS_ZOMBIE and _is_ours(child):
                found.append(child)
    return found


def _is_ours(process):
    command = " ".join(process.cmdline())
    return SERVER in command or "spawn_main" in command


def _is_server(process):
    """Whether it was started for itself: its forks have its command, and so has their parent."""
    psutil = pytest.importorskip("psutil")
    with contextlib.suppress(psutil.Error):
        if SERVER not in " ".join(process.cmdline()):
            return False
        parent = process.parent()
        return parent is None or SERVER not in " ".join(parent.cmdline())
    return False
