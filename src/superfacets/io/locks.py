"""Folders that one process at a time writes results to."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from .atomic import writable_folder

__all__ = ["locked"]


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
    try:
        import fcntl
    except ImportError:  # Windows: two starts at once would do work twice, and no harm
        yield
        return
    with (folder / ".lock").open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ValueError(f"{folder}: another run is writing there") from None
        yield
