"""The worker processes that a batch, or a run in tiles, has started on this machine."""

import contextlib

import pytest

TEMPLATE = "copy_on_demand"


def worker_processes():
    """Processes below us that do work: copies of a template, or new ones."""
    return [child for child in _children() if not _is_template(child)]


def templates():
    """Processes that workers are copies of."""
    return [child for child in _children() if _is_template(child)]


def _children():
    psutil = pytest.importorskip("psutil")
    found = []
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):  # one that was killed a moment ago
            command = " ".join(child.cmdline())
            if TEMPLATE in command or "spawn_main" in command:
                found.append(child)
    return found


def _is_template(process):
    """Whether it was started for itself: its copies have its command, and so has their parent."""
    psutil = pytest.importorskip("psutil")
    with contextlib.suppress(psutil.Error):
        if TEMPLATE not in " ".join(process.cmdline()):
            return False
        parent = process.parent()
        return parent is None or TEMPLATE not in " ".join(parent.cmdline())
    return False
