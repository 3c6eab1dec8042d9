"""Write files atomically, so that incomplete files never appear; lock files and folders."""

from __future__ import annotations

import contextlib
import os
import re
import stat
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

StrPath = str | os.PathLike[str]
"""Types of the path of a file in signatures."""

STEM_SIZE = 40
"""Maximum number of characters that are copied from the name of an output to the name of its
temporary file. The number is limited because file systems limit names to 255 bytes."""

OLD = 24 * 3600.0
"""Minimum age, in seconds, of temporary files that are removed. Writing a file takes less time."""

_TEMPORARY = re.compile(r"\.(.*)\.[0-9a-f]{12}\.tmp", re.DOTALL)

_FLAGS = getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
"""Flags for opening lock files. With `O_NONBLOCK`, opening a pipe does not wait for a writer."""


@contextlib.contextmanager
def atomic_outputs(paths: Sequence[StrPath]) -> Iterator[list[Path]]:
    """Yield a temporary path for each of `paths`; rename all to `paths` if the block succeeds.

    Otherwise, temporary files are removed, and existing files are unchanged. A new file gets the
    permissions of the file that it replaces. A symbolic link is replaced, and its target is
    unchanged, because somebody else may have created the link.

    All files are complete before the first is renamed, but if a rename fails, previous ones are not
    undone. Files that a killed process leaves behind are removed by the next one that writes to the
    same path, if they are at least a day old. Raises the same errors as `checked_targets`.
    """
    targets = checked_targets(paths)
    remove_leftovers(targets)
    # All names are chosen before a file is created, so that an interrupt leaves no file behind.
    temporaries = [
        target.with_name(f".{target.name[:STEM_SIZE]}.{os.urandom(6).hex()}.tmp")
        for target in targets
    ]
    try:
        for temporary, target in zip(temporaries, targets, strict=True):
            temporary.touch(exist_ok=False)
            if target.exists() and not target.is_symlink():
                temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        yield temporaries
        for temporary, target in zip(temporaries, targets, strict=True):
            temporary.replace(target)
    except OSError as error:  # report the name of the output instead of the temporary file
        names = dict(zip(temporaries, map(str, paths), strict=True))
        name = ", ".join(names.values()) if error.filename is None else error.filename
        if error.errno is not None:
            error.filename = names.get(Path(name), name)
        raise
    finally:
        for temporary in temporaries:
            with contextlib.suppress(OSError):  # the file was renamed or was never created
                temporary.unlink()


def remove_leftovers(targets: Iterable[Path], *, older_than: float = OLD) -> None:
    """Remove temporary files of `targets` that are at least `older_than` seconds old."""
    stems: dict[Path, set[str]] = {}
    for target in targets:
        stems.setdefault(target.parent, set()).add(target.name[:STEM_SIZE])
    newest = time.time() - older_than
    for folder, wanted in stems.items():
        for path in folder.glob(".*.tmp"):
            name = _TEMPORARY.fullmatch(path.name)
            with contextlib.suppress(OSError):  # another process may have removed the file
                found = path.lstat()
                is_old = stat.S_ISREG(found.st_mode) and found.st_mtime <= newest
                if is_old and name is not None and name[1] in wanted:
                    path.unlink()


def checked_targets(paths: Sequence[StrPath]) -> list[Path]:
    """Return the real path of each output: symbolic links to its folder are resolved.

    Apps call this function before long work. An output that is a link itself is not resolved.
    Raises an OSError if a folder is missing or not writable, or if an existing file is
    write-protected or not a regular file. Raises a ValueError if two paths refer to the same file.
    """
    targets: dict[Path, None] = {}  # an ordered set
    for path in paths:
        given = Path(path)
        target = Path(os.path.realpath(given.parent), given.name)
        _check_target(path, target)
        if target in targets:
            raise ValueError(f"{path}: the same output is given twice")
        targets[target] = None
    return list(targets)


def writable_folder(folder: Path) -> None:
    """Create a folder for outputs if it is missing. Raise an OSError if it is not writable."""
    if folder.exists() and not folder.is_dir():
        raise NotADirectoryError(f"{folder}: is a file, not a folder")
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(f"{folder}: the folder is not writable")


@contextlib.contextmanager
def output_folder(folder: Path) -> Iterator[None]:
    """Create a missing folder for outputs of the block; remove it after the block if it is empty.

    Commands use this for folders that the user names, so that failures leave no empty folder. A
    folder that existed before is not removed. Missing parent folders are created and removed in the
    same way. Raises an OSError if the folder is not writable.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    writable_folder(folder)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # the folder is not empty
            for path in missing:
                path.rmdir()


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


def open_own(path: Path, flags: int, busy: str | None = None) -> int:
    """Open a file that only this package writes, and return its descriptor.

    Apps use this for journals. If `busy` is given, the file is locked until it is closed, or a
    ValueError with the message `busy` is raised if it is already locked. Raises an OSError if the
    path is not a regular file. Links are refused, because they may lead to an important file.
    """
    with contextlib.suppress(FileNotFoundError):
        mode = path.lstat().st_mode
        if stat.S_ISLNK(mode):
            raise OSError(f"{path}: expected a file, got a link: remove the link")
        if not stat.S_ISREG(mode):
            raise OSError(f"{path}: is not a regular file")
    file = os.open(path, flags | _FLAGS, 0o666)
    try:
        if busy is not None:
            _lock(file, path, busy)
    except BaseException:
        os.close(file)
        raise
    return file


@contextlib.contextmanager
def locked(folder: Path, outputs: Sequence[Path] = ()) -> Iterator[None]:
    """Lock a folder during the block, or raise a ValueError if the folder is already locked.

    Programs use it so that only one process at a time writes `outputs` to the folder, which is
    created if missing. Temporary files of `outputs` are removed before and after the block. The
    lock file stays, but the operating system releases the lock when this process ends.
    """
    writable_folder(folder)
    path = folder / ".lock"
    busy = f"{folder}: another run is writing to this folder"
    file = open_own(path, os.O_RDWR | os.O_CREAT, busy)
    with os.fdopen(file, "rb"):
        remove_leftovers(outputs, older_than=0.0)
        try:
            yield
        finally:
            remove_leftovers(outputs, older_than=0.0)


def _lock(file: int, path: Path, busy: str) -> None:
    """Lock an open file, or raise a ValueError with the message `busy` if it is already locked."""
    from filelock import lock_descriptor

    try:
        is_ours = lock_descriptor(file, blocking=False)
    except OSError as error:
        raise OSError(error.errno, f"cannot be locked: {error.strerror}", str(path)) from None
    if not is_ours:
        raise ValueError(busy)
