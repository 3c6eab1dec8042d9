"""Folders and files that one process at a time writes to."""

from __future__ import annotations

import contextlib
import re
import secrets
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from .atomic import writable_folder

__all__ = ["despite_interrupts", "lock_file", "locked", "temporary_folder"]

_LOCK = ".lock"
"""A file in a folder that the process at work there holds locked."""


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
    with (folder / _LOCK).open("a") as file:
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


@contextlib.contextmanager
def temporary_folder(parent: Path, mark: str) -> Iterator[Path]:
    """Make a folder below `parent`, and remove it when the block ends, also by errors and Ctrl-C.

    Its name begins with `mark`. Such folders that killed processes have left there are removed
    first, if the system can tell. An OSError if the folder cannot be made.
    """
    writable_folder(parent)
    if sys.platform != "win32":  # there, whether a process holds one cannot be told
        _remove_leftovers(parent, mark)
    folder = parent / f"{mark}{secrets.token_hex(6)}"
    try:
        folder.mkdir()
        with (folder / _LOCK).open("a") as file:
            lock_file(file.fileno(), f"{folder}: another run is writing there")
            yield folder
    finally:
        despite_interrupts(lambda: shutil.rmtree(folder, ignore_errors=True))


def _remove_leftovers(parent: Path, mark: str) -> None:
    """Remove temporary folders that no process holds; nothing else, whatever its name."""
    for folder in parent.glob(f"{mark}*"):
        if not re.fullmatch(re.escape(mark) + r"[0-9a-f]{12}", folder.name) or folder.is_symlink():
            continue
        with contextlib.suppress(OSError, ValueError), (folder / _LOCK).open("r") as file:
            lock_file(file.fileno(), "")
            shutil.rmtree(folder, ignore_errors=True)


def despite_interrupts(work: Callable[[], object]) -> None:
    """Call `work` until it ends without a Ctrl-C; then raise the last one, if there was any."""
    interrupt: KeyboardInterrupt | None = None
    is_done = False
    while not is_done:
        try:
            work()
            is_done = True
        except KeyboardInterrupt as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt
