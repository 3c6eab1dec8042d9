"""Files of ours in users' folders: they appear whole or not at all, and are locked."""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import stat
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

StrPath = str | os.PathLike[str]

STEM_SIZE = 40
"""Characters of a name that its temporary file keeps: file systems allow 255 bytes in all."""

OLD = 24 * 3600.0
"""Seconds after which a temporary file counts as left behind: no writer takes that long."""

_TEMPORARY = re.compile(r"\.(.*)\.[0-9a-f]{12}\.tmp", re.DOTALL)

_FLAGS = getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Windows has only the first. With O_NONBLOCK a pipe is opened without waiting for a writer."""


@contextlib.contextmanager
def atomic_outputs(paths: Sequence[StrPath]) -> Iterator[list[Path]]:
    """Give a temporary path for each of `paths`; rename all when the block ends well.

    The temporary files lie in the folders of `paths`, exist, and are empty. If the block raises,
    be it KeyboardInterrupt, they are removed and files at `paths` are left as they were. A new
    file gets the permissions that any new file gets; a file that replaces another keeps the
    other's. A link is replaced by the file, and the file that the link points to stays as it was:
    a folder from somebody else may hold a link of the name of an output.

    All is written before anything is renamed, but several renames are not one step: if a later one
    fails (the folder was taken away meanwhile), the earlier ones stand. A process that is killed
    leaves its temporary files behind; the next one that writes to the same path a day later, or
    more, removes them.

    Errors are those of `checked_targets`.
    """
    targets = checked_targets(paths)
    remove_leftovers(targets)
    # Named before any file is made, so that an interrupt at any time finds the files to remove.
    temporaries = [
        target.with_name(f".{target.name[:STEM_SIZE]}.{secrets.token_hex(6)}.tmp")
        for target in targets
    ]
    try:
        for temporary, target in zip(temporaries, targets, strict=True):
            _create(temporary, target)
        yield temporaries
        for temporary, target in zip(temporaries, targets, strict=True):
            temporary.replace(target)
    except OSError as error:  # say what was being written, where the system does not
        names = dict(zip(temporaries, map(str, paths), strict=True))
        name = ", ".join(names.values()) if error.filename is None else error.filename
        if error.errno is not None:
            error.filename = names.get(Path(name), name)
        raise
    finally:
        for temporary in temporaries:
            with contextlib.suppress(OSError):  # it was renamed, or never made
                temporary.unlink()


def remove_leftovers(targets: Iterable[Path], *, older_than: float = OLD) -> None:
    """Remove temporary files of these outputs that were not written to for so many seconds.

    Files of other outputs, folders and links stay, whatever their names.
    """
    stems: dict[Path, set[str]] = {}
    for target in targets:
        stems.setdefault(target.parent, set()).add(target.name[:STEM_SIZE])
    newest = time.time() - older_than
    for folder, wanted in stems.items():
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                name = _TEMPORARY.fullmatch(entry.name)
                is_ours = name is not None and name[1] in wanted
                if is_ours and entry.is_file(follow_symlinks=False):
                    _remove_if_old(entry, newest)


def _remove_if_old(entry: os.DirEntry[str], newest: float) -> None:
    with contextlib.suppress(OSError):  # another writer has just removed it
        if entry.stat(follow_symlinks=False).st_mtime <= newest:
            Path(entry.path).unlink()


def checked_targets(paths: Sequence[StrPath]) -> list[Path]:
    """Return the files or links that outputs at `paths` would make or replace.

    Links to folders on the way are followed. An OSError if a folder is missing or not writable, if
    a file is write-protected or no file; a ValueError if two paths are the same file.
    """
    targets: dict[Path, None] = {}  # a set that keeps their order
    for path in paths:
        given = Path(path)
        target = Path(os.path.realpath(given.parent), given.name)
        _check_target(path, target)
        if target in targets:
            raise ValueError(f"{path}: the same output is given twice")
        targets[target] = None
    return list(targets)


def writable_folder(folder: Path) -> None:
    """Make a folder for outputs, if it is not there; an OSError if it cannot be written."""
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"{folder}: the folder is not writable")


def _check_target(path: StrPath, target: Path) -> None:
    folder = target.parent
    if not folder.exists():
        raise FileNotFoundError(f"{path}: the folder {folder} does not exist")
    if not folder.is_dir():
        raise NotADirectoryError(f"{path}: {folder} is not a folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"{path}: the folder {folder} is not writable")
    if target.is_dir():
        raise IsADirectoryError(f"{path}: is a folder, not a file")
    if target.exists() and not target.is_file():
        raise OSError(f"{path}: is not a regular file")
    if target.exists() and not target.is_symlink() and not os.access(target, os.W_OK):
        raise PermissionError(f"{path}: the file is write-protected")


def _create(temporary: Path, target: Path) -> None:
    """Make an empty file with the permissions of the target, or of any new file."""
    temporary.touch(exist_ok=False)
    if target.exists() and not target.is_symlink():
        temporary.chmod(stat.S_IMODE(target.stat().st_mode))


def open_own(path: Path, flags: int) -> int:
    """Open a file of ours, and return its descriptor; an OSError if it is not a regular file.

    Links are refused: the folder may come from somebody else, with a link to any file of the user.
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
    """Make the folder and lock it; a ValueError if another process has locked it."""
    writable_folder(folder)
    with held(folder / ".lock", f"{folder}: another run is writing there"):
        yield


@contextlib.contextmanager
def held(path: Path, message: str) -> Iterator[None]:
    """Hold the lock of a file, made if missing; a ValueError if another process holds it.

    The file stays. The lock ends with this process, however it ends, and child processes that
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

    An OSError if the file system has no locks.
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
