"""Folders and files that one process at a time writes to."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .atomic import writable_folder

__all__ = ["lock_file", "locked"]


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Make the folder and lock it against other starts, if the system can.

    Raises
    ------
    ValueError
        If another start is using it.
    OSError
        If it cannot be made or written, or is a file.
    """
    writable_folder(folder)
    with (folder / ".lock").open("a") as file:
        lock_file(file.fileno(), f"{folder}: another run is writing there")
        yield


def lock_file(file: int, message: str) -> None:
    """Lock an open file until it is closed, if the system can; a ValueError if another has it."""
    try:
        import fcntl
    except ImportError:  # Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise ValueError(message) from None
