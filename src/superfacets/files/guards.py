"""Open files, choose formats, and limit the size of arrays, for the readers of all formats."""

from __future__ import annotations

import contextlib
import io
import mmap
import os
import re
import stat
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ..base.checks import counted, refuse_order
from ..base.errors import MeshError
from ..base.types import Array, Longs
from .atomic import StrPath

MAX_GROWTH = 100
"""Maximum size of the arrays of a file, as a multiple of the file size, in formats that compress
arrays or refer to an array several times."""

ALWAYS_ALLOWED = 64 << 20
"""Size of arrays, in bytes, that is accepted for files of any size."""


class Polygons(NamedTuple):
    """Faces with different numbers of corners, or with more than three corners."""

    offsets: Longs  # (F + 1,) start of each face in `indices`, then the length of `indices`
    indices: Array  # (C,) vertex index of each corner


Content = bytes | mmap.mmap
"""Content of a file, for parsers. Slices are bytes, and NumPy reads both types without copying."""


def known_ending(path: StrPath, endings: Sequence[str]) -> str:
    """Return the longest ending in `endings` that a file name has; it selects the format.

    Raises a MeshError if the file name has none of the endings. Letter case is ignored. An ending
    may contain several dots, for example ``.segs.json``.
    """
    refuse_order(path, "a path")
    path = Path(path)
    name = path.name.lower()
    fitting = [ending for ending in endings if name.endswith(ending) and name != ending]
    if not fitting:
        given = path.suffix.lower() or "none"
        listed = [each for each in endings if each.endswith(given)] or endings  # .json: .segs.json
        others = {"meshio": (".msh", ".mesh"), "geopandas": (".shp", ".geojson", ".gpkg")}
        advice = "".join(f"{name} writes {given}; " for name in others if given in others[name])
        raise MeshError(f"{path}: {advice}expected the ending {', '.join(listed)}, got {given}")
    return max(fitting, key=len)


def read_content(path: Path) -> mmap.mmap:
    """Return the content of a file for a parser, or raise a MeshError if the file is empty.

    The file is not memory-mapped, because the process would crash if the file were truncated later.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if not size:
            raise MeshError(f"{path}: the file is empty")
        content = _new_memory(size)
        left = memoryview(content)
        while left:  # one read returns at most 2 GB
            n_bytes = file.readinto(left)
            if not n_bytes:
                raise OSError(f"{path}: the file became shorter while it was read")
            left = left[n_bytes:]
    return content


def file_beside(name: str, folder: Path | None) -> Path | None:
    """Return the file at a path relative to `folder`, or None if the file is not inside it.

    Readers use it for images, materials and buffers that a mesh file names, which may be missing.
    For security, a mesh file cannot refer to files elsewhere on the machine: URLs and absolute
    paths are refused, and ``..`` and symbolic links are resolved first.
    """
    if folder is None or re.match(r"[\w+.-]*:|[/\\]", name) or "\0" in name:
        return None
    path = Path(os.path.realpath(folder / name))
    return path if path.is_relative_to(os.path.realpath(folder)) else None


@contextlib.contextmanager
def named_errors(path: object) -> Iterator[None]:
    """In a block that parses a file, prepend `path` to the message of any MeshError."""
    try:
        yield
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def open_regular(path: Path) -> io.FileIO:
    """Open a file for reading, or raise an OSError if it is not a regular, readable file.

    Other kinds of files are not opened, because a pipe may block and a device may be endless.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: no such file") from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(f"{path}: is a folder, not a file: pass the files in it")
    if not stat.S_ISREG(mode):
        raise OSError(f"{path}: is not a regular file, but a device or a pipe")
    if not os.access(path, os.R_OK):
        raise PermissionError(f"{path}: you have no permission to read the file")
    return path.open("rb", buffering=0)


def _new_memory(size: int) -> mmap.mmap:
    """Allocate memory, in huge pages if possible. Filling a bytes object takes 5 times as long."""
    if not hasattr(mmap, "MAP_PRIVATE"):  # Windows
        return mmap.mmap(-1, size)
    memory = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with contextlib.suppress(OSError):  # errors are harmless, because madvise is only a hint
            memory.madvise(mmap.MADV_HUGEPAGE)
    return memory


def faces_of(corner_counts: Array, corners: Array) -> Array | Polygons:
    """Build triangles, (F, 3), or else polygons, from the corners of all faces."""
    if (corner_counts == 3).all():
        return corners.reshape(-1, 3)
    offsets = np.zeros(len(corner_counts) + 1, dtype=np.int64)
    np.cumsum(corner_counts, out=offsets[1:])
    return Polygons(offsets, corners.ravel())


class BinaryReader:
    """Cursor that reads numbers and texts from bytes; sizes are checked before memory is used.

    Readers of binary formats use this class. `order` is the byte order, `begin` the first offset,
    and `at` the next offset.
    """

    def __init__(self, data: Content, order: Literal["<", ">"] = "<", begin: int = 0) -> None:
        self._data, self._order, self.at = data, order, begin

    def take(self, form: str) -> tuple[Any, ...]:
        """Return the next numbers; `form` is a format string of `struct`."""
        start = self.at
        self.skip(struct.calcsize(self._order + form))
        return struct.unpack_from(self._order + form, self._data, start)

    def numbers(self, n: int, dtype: str) -> Array:
        """Return the next `n` numbers as an array."""
        start, stored = self.at, np.dtype(dtype)
        self.skip(n * stored.itemsize)
        return np.frombuffer(self._data, stored.newbyteorder(self._order), n, start).astype(stored)

    def text(self, end: bytes = b"\0") -> str:
        """Return the next text, without the byte `end` that terminates it."""
        start, place = self.at, self._data.find(end, self.at)
        self.skip((place if place >= 0 else len(self._data)) + 1 - start)
        return self._data[start:place].decode("utf-8", "replace")

    def skip(self, n_bytes: int) -> None:
        """Skip bytes; raise a MeshError if their number is negative, or if fewer bytes are left."""
        if not 0 <= n_bytes <= len(self._data) - self.at:
            raise MeshError(
                f"the file ends after {counted(len(self._data), 'byte')}, but {n_bytes} more are"
                f" declared at byte {self.at}: it may be truncated or damaged"
            )
        self.at += n_bytes


def most_bytes_of(n_bytes: int) -> int:
    """Return the maximum number of bytes that readers may expand a file of `n_bytes` bytes to."""
    return max(ALWAYS_ALLOWED, MAX_GROWTH * n_bytes)
