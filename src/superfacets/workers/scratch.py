"""Store temporary arrays in memory, and in a scratch folder that is removed at the end."""

from __future__ import annotations

import contextlib
import errno
import re
import secrets
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .._types import Array
from ..export.scannet import write_array
from ..io.atomic import held, is_unlocked, writable_folder
from ..io.guards import fill
from ..io.readers.npy import npy_header
from ..io.tables import RecordRows
from .threads import despite_interrupts

MARK = ".superfacets-tiles-"
"""Prefix of the names of scratch folders."""

_FOLDER = re.compile(re.escape(MARK) + r"[0-9a-f]{12}")

LOCK = ".lock"
"""Name of the lock file in a scratch folder. If the file is not locked, the process that created
the folder was killed."""

_HEADER_SIZE = 128
"""Size of the header of ``.npy`` files in bytes. NumPy pads short headers to this size."""


@contextlib.contextmanager
def scratch_folder(parent: Path, cache: int = 0) -> Iterator[Scratch]:
    """Create a scratch folder in `parent`; remove it after the `with` block, even after Ctrl-C.

    Scratch folders of killed processes are removed first. `cache` is the size of the cache in
    bytes. Raises an OSError if the folder cannot be created.
    """
    writable_folder(parent)
    _remove_leftovers(parent)
    folder = parent / f"{MARK}{secrets.token_hex(6)}"
    try:
        folder.mkdir()
        with held(folder / LOCK, f"{folder}: another run has removed this folder: run again"):
            yield Scratch(folder, cache)
    finally:
        despite_interrupts(lambda: shutil.rmtree(folder, ignore_errors=True))


def check_room(parent: Path, needed: int) -> None:
    """Raise an OSError if the disk with the folder `parent` has fewer than `needed` free bytes."""
    free = shutil.disk_usage(parent).free
    if free < needed:
        unit, name = (1e9, "GB") if needed >= 1e9 else (1e6, "MB")
        raise OSError(
            errno.ENOSPC,
            f"the disk has {free / unit:.1f} {name} free, but about {needed / unit:.1f} {name} are"
            " needed: choose a scratch folder on another disk",
            str(parent),
        )


def _remove_leftovers(parent: Path) -> None:
    for folder in parent.glob(f"{MARK}*"):
        is_ours = _FOLDER.fullmatch(folder.name) and not folder.is_symlink()
        if is_ours and is_unlocked(folder / LOCK):
            shutil.rmtree(folder, ignore_errors=True)


class Scratch:
    """Named arrays in a folder, which several processes can write and read.

    Arrays are written atomically and can be overwritten, so that interrupted work can be repeated.
    As long as arrays fit into a cache of `cache` bytes, they are kept in memory and not written.
    Other processes cannot read arrays in memory, so `cache` should be 0 if there are other
    processes.
    """

    def __init__(self, folder: Path, cache: int = 0) -> None:
        self.folder = folder
        self._room = cache
        self._kept: dict[str, Array] = {}
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[type[Scratch], tuple[Path]]:
        return Scratch, (self.folder,)

    def save(self, name: str, array: Array) -> None:
        """Store an array in memory (and make it read-only) or on disk; `name` may have slashes."""
        if self.keep(name, array):
            return
        # The scratch folder itself is not created: if it was removed, writing must fail.
        for parent in reversed(Path(name).parents[:-1]):
            (self.folder / parent).mkdir(exist_ok=True)
        path = self._path(name)
        partial = path.with_name(f".{path.name}.{secrets.token_hex(6)}.tmp")
        try:
            write_array(partial, array)
            partial.replace(path)
        except OSError as error:
            if error.filename is None and error.errno is not None:
                error.filename = str(path)
            raise
        finally:
            with contextlib.suppress(OSError):  # the file was renamed or never created
                partial.unlink()

    def keep(self, name: str, array: Array) -> bool:
        """Store an array in memory if the cache has enough room; return whether it was stored."""
        self._forget(name)
        with self._lock:
            is_kept = array.nbytes < self._room
            self._room -= array.nbytes if is_kept else 0
        if is_kept:
            if isinstance(array.base, np.ndarray) and array.base.nbytes > array.nbytes:
                array = array.copy()  # a view would keep the whole base array in memory
            array = np.ascontiguousarray(array)
            array.flags.writeable = False
            self._kept[name] = array
            self._path(name).unlink(missing_ok=True)
        return is_kept

    def load(self, name: str, begin: int = 0, end: int | None = None) -> Array:
        """Return rows `begin` to `end` - 1 of an array; callers must not modify the result."""
        # Files are not memory-mapped, because memory maps count toward address space limits.
        kept = self._kept.get(name)
        if kept is not None:
            return kept[begin:end]
        with self._path(name).open("rb", buffering=0) as file:
            shape, dtype, _, start = npy_header(file.read(_HEADER_SIZE))
            rows = np.empty(((shape[0] if end is None else end) - begin, *shape[1:]), dtype)
            if rows.size:
                file.seek(start + begin * rows[:1].nbytes)
                fill(rows.reshape(-1).view(np.uint8), file)
        return rows

    def has(self, name: str) -> bool:
        """Return whether an array with this name exists."""
        return name in self._kept or self._path(name).exists()

    def remove(self, name: str) -> None:
        """Remove an array, if it exists."""
        self._forget(name)
        self._path(name).unlink(missing_ok=True)

    def remove_folder(self, name: str) -> None:
        """Remove all arrays in a folder."""
        for kept in [other for other in list(self._kept) if other.startswith(f"{name}/")]:
            self._forget(kept)
        shutil.rmtree(self.folder / name, ignore_errors=True)

    def _forget(self, name: str) -> None:
        array = self._kept.pop(name, None)
        if array is not None:
            with self._lock:
                self._room += array.nbytes

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.npy"


class RowFile:
    """A file in the scratch folder to which rows are appended in a `with` block."""

    def __init__(self, scratch: Scratch) -> None:
        self._path = scratch.folder / secrets.token_hex(6)
        self._file = self._path.open("wb")
        self._row: np.dtype[Any] | None = None
        self.n_rows = 0

    def __enter__(self) -> RowFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, rows: Array) -> None:
        """Append rows; all rows in the file must have the same dtype and number of columns."""
        if self._row is None:
            self._row = np.dtype((rows.dtype, rows.shape[1:]))
        self._file.write(np.ascontiguousarray(rows, self._row.base).data)
        self.n_rows += len(rows)

    def rows(self, width: int = 1) -> RecordRows:
        """Return the rows of the file as a table.

        If single numbers were added, `width` consecutive numbers form a row of the table.
        """
        assert self._row is not None
        row = self._row if width == 1 else (self._row, (width,))
        record = np.dtype([("row", row)])
        return RecordRows(self._path, 0, self.n_rows // width, record, ("row",))
