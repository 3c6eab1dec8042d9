"""Our files in users' folders: opened without following links, and locked between processes."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from .atomic import writable_folder

_FLAGS = getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Windows has only the first. With O_NONBLOCK a pipe is opened without waiting for a writer."""


def open_own(path: Path, flags: int) -> int:
    """Open a file of ours, and return its descriptor; links are not followed.

    The folder may come from somebody else, with a link to any file of the user under that name.

    Raises
    ------
    OSError
        If it is a link, or anything else than a regular file, or cannot be opened.
    """
    with contextlib.suppress(FileNotFoundError):
        mode = path.lstat().st_mode
        if stat.S_ISLNK(mode):
            raise OSError(f"{path}: expected a file, got a link: remove it")
        if not stat.S_ISREG(mode):
            raise OSError(f"{path}: is not a regular file")
    return os.open(path, flags | _FLAGS, 0o666)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Make the folder and lock it against other starts.

    Raises
    ------
    ValueError
        If another start is using it.
    OSError
        If it cannot be made, written or locked, or is a file.
    """
    writable_folder(folder)
    with held(folder / ".lock", f"{folder}: another run is writing there"):
        yield


@contextlib.contextmanager
def held(path: Path, message: str) -> Iterator[None]:
    """Hold the lock of a file, made if missing; a ValueError if another process holds it.

    The file stays. The lock ends with this process, however that ends, and child processes that
    run another program do not inherit it.
    """
    file = open_own(path, os.O_RDWR | os.O_CREAT)
    try:
        lock_file(file, path, message)
        yield
    finally:
        os.close(file)


def is_left_behind(path: Path) -> bool:
    """Whether the lock file exists and no process holds it."""
    try:
        file = open_own(path, os.O_RDWR)
    except OSError:
        return False
    try:
        return _is_locked_now(file)
    except OSError:
        return False
    finally:
        os.close(file)


def lock_file(file: int, path: Path, message: str) -> None:
    """Lock an open file until it is closed; a ValueError with the message if it is locked.

    Raises
    ------
    OSError
        If the file system has no locks.
    """
    try:
        is_ours = _is_locked_now(file)
    except OSError as error:
        raise OSError(error.errno, f"cannot be locked: {error.strerror}", str(path)) from None
    if not is_ours:
        raise ValueError(message)


def _is_locked_now(file: int) -> bool:
    """Try to lock an open file; return whether it is locked now."""
    from filelock import lock_descriptor

    return lock_descriptor(file, blocking=False)
