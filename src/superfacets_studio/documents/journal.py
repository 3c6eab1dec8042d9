"""Read and write the work file, to which each operation appends one line of JSON.

A line is on disk before the client gets a reply. Therefore, a crash can damage only the last line,
whose operation the client does not consider done.
"""

from __future__ import annotations

import contextlib
import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from superfacets import MeshError
from superfacets.kit import open_own

FORMAT = "superfacets studio"
VERSION = 2
SHARED = "shared"  # entry "op" of a line with the class list that the meshes of a folder share
READABLE = (1, VERSION)  # versions of the format that can be opened; version 1 has no objects

_BEGIN = json.dumps({"format": FORMAT}, separators=(",", ":"))[:-1].encode("ascii")
"""First bytes of every work file."""

_SUM = b',"crc":"%08x"}'  # end of each line, with the CRC-32 of the earlier bytes of the line
_LAST_BYTES = 1 << 12  # bytes at the end of a file in which the last line is searched first

Line = dict[str, Any]


class JournalError(MeshError):
    """Error raised if a work file cannot be used."""


class WriteError(JournalError):
    """Error raised if an operation is not done because it cannot be written to the work file."""


@dataclass
class Journal:
    """Open work file, which is locked so that no other server can open it."""

    path: Path
    header: Line  # content of the first line
    lines: list[Line]  # lines after the header; empty after they have been replayed
    notes: list[str]  # messages for the user about damage that was repaired
    _file: int = field(repr=False)  # descriptor; -1 after `close` and from `parsed_work`
    _size: int = field(repr=False)  # size of all complete lines, in bytes
    _fault: str | None = None  # why nothing more can be written; None if writing is possible

    @classmethod
    def open(cls, path: Path, header: Mapping[str, Any]) -> Journal:
        """Open a work file, or create it with `header` as the first line.

        An incomplete last line is removed, and after an error an empty file. Raises JournalError if
        another studio has the file open, if it is not a work file or was written by a later
        version, or if a line before the last line is damaged; OSError if reading or writing fails.
        """
        busy = f"{path}: another studio has this work file open"
        try:
            file = open_own(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, busy)
        except ValueError as error:
            raise JournalError(str(error)) from None
        try:
            with os.fdopen(file, "rb", closefd=False) as reader:
                reader.seek(0)
                data = reader.read()
            lines, size, notes = _read_lines(path, data)
            journal = cls(path, {}, lines[1:], notes, file, size)
            if size < len(data):
                os.ftruncate(file, size)
                os.fsync(file)
            if lines:
                journal.header = lines[0]
            else:
                journal.header = {"format": FORMAT, "version": VERSION, **header}
                journal.append(journal.header)
                _sync_folder(path.parent)
        except BaseException:
            with contextlib.suppress(OSError):  # Windows does not remove open files
                if not os.fstat(file).st_size:
                    path.unlink()
            os.close(file)
            raise
        return journal

    @property
    def is_of_folder(self) -> bool:
        """Whether the work began in a folder whose meshes share their classes."""
        return self.header.get("classes", ()) is None

    def check_source(self, source: Path, digest: str, n_cells: int) -> None:
        """Raise a JournalError if this is not a work file of `source`, or if its header is damaged.

        `digest` is the SHA-256 hash of the input file `source`, which has `n_cells` cells.
        """
        file, found = self.header.get("file"), self.header.get("n_cells")
        if not isinstance(file, dict) or found is None:
            raise JournalError(f"{self.path}: the first line of the work file is damaged")
        if (file.get("sha256"), found) == (digest, n_cells):
            return
        name = file.get("name")
        if name == source.name:
            reason = f"{source} has changed since the work was begun"
        else:
            reason = f"the work file belongs to {name}, not to {source.name}"
        raise JournalError(
            f"{self.path}: {reason}: restore the old file, or use another work file (--work of"
            " superfacets studio)"
        )

    def append(self, line: Mapping[str, Any]) -> None:
        """Append a line, and return after it is on disk.

        Raises WriteError if the line cannot be written completely, or if another program has
        replaced or changed the file. A partly written line is removed.
        """
        self._check()
        data = _coded(line)
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._file, rest) :]
            os.fsync(self._file)
        except BaseException as error:  # also after an interrupt, memory and file are the same
            self._take_back()
            if not isinstance(error, OSError):
                raise
            reason = error.strerror or str(error)
            raise WriteError(f"{self.path}: {reason}: the operation was not done") from None
        self._size += len(data)

    def close(self) -> None:
        """Close the file and release its lock."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _check(self) -> None:
        """Raise a WriteError if the file is closed, or if `_fault` says why writing is impossible.

        A WriteError is also raised if another program has changed, replaced or removed the file.
        """
        if self._fault is not None:
            raise WriteError(self._fault)
        if self._file < 0:
            raise WriteError(f"{self.path}: the work file is closed")
        own = os.fstat(self._file)
        try:
            there = self.path.stat()
        except OSError:
            message = f"{self.path}: the work file is gone: the operation was not done"
            raise WriteError(message) from None
        if (own.st_dev, own.st_ino) != (there.st_dev, there.st_ino) or own.st_size != self._size:
            message = f"{self.path}: another program changed the work file: start the studio again"
            raise WriteError(message)

    def _take_back(self) -> None:
        """Remove the incomplete line of a failed write; if this fails, reject all later writes."""
        try:
            os.ftruncate(self._file, self._size)
            os.fsync(self._file)
        except OSError:
            self._fault = f"{self.path}: can no longer be written: start the studio again"


def parsed_work(path: Path, data: bytes) -> Journal:
    """Parse the content of a work file, and return a journal that nothing can be appended to.

    `path` is used in messages. Raises JournalError if the data is not a work file or was written by
    a later version, or if a line before the last line is damaged.
    """
    lines, size, notes = _read_lines(path, data)
    if not lines:
        raise JournalError(f"{path}: is not a work file of superfacets studio")
    return Journal(path, lines[0], lines[1:], notes, -1, size)


def summary(path: Path) -> tuple[Line, Line] | None:
    """Return the first and the last complete line of a work file, without locking the file.

    Returns None if the file does not exist, has no complete line, or cannot be read. Raises
    JournalError if the first line is damaged, or if the file cannot be opened, for example because
    it is a link.
    """
    try:
        opened = open_own(path, os.O_RDONLY)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise JournalError(str(error)) from None
    with contextlib.suppress(OSError), os.fdopen(opened, "rb") as file:
        begin = file.readline()
        first = _parsed(begin[:-1])
        if first is None and begin.endswith(b"\n"):
            raise JournalError(f"{path}: line 1 of the work file is damaged")
        size = file.seek(0, os.SEEK_END)
        n_bytes = _LAST_BYTES
        while first is not None:
            file.seek(max(0, size - n_bytes))
            lines = file.read(n_bytes).split(b"\n")[:-1]
            last = _parsed(lines[-1]) if lines else None
            if last is not None or n_bytes >= size:
                return first, last or first
            n_bytes *= 8
    return None


def _read_lines(path: Path, data: bytes) -> tuple[list[Line], int, list[str]]:
    """Return the valid lines, their size in bytes, and a note if the last line is damaged.

    Raises the errors of `parsed_work`.
    """
    if data and not data.startswith(_BEGIN[: len(data)]):
        raise JournalError(f"{path}: is not a work file of superfacets studio")
    lines: list[Line] = []
    size = 0
    for text in data.splitlines(keepends=True):
        line = _parsed(text[:-1]) if text.endswith(b"\n") else None
        if line is None:
            break
        lines.append(line)
        size += len(text)
    if b"\n" in data[size:-1]:
        raise JournalError(
            f"{path}: line {len(lines) + 1} of the work file is damaged: make a copy of the file,"
            " then delete this line and all lines after it; the lines before it are valid"
        )
    if lines and lines[0].get("version") not in READABLE:
        raise JournalError(f"{path}: was written by a later version of superfacets")
    note = f"{path}: the last line was incomplete, as after a crash, and was left out"
    return lines, size, [note] if size < len(data) else []


def _coded(line: Mapping[str, Any]) -> bytes:
    body = json.dumps(line, separators=(",", ":")).encode("ascii")[:-1]
    return body + _SUM % zlib.crc32(body) + b"\n"


def _parsed(text: bytes) -> Line | None:
    """Return the content of a line of JSON, or None if the line is damaged."""
    body = text[: -len(_SUM % 0)]
    if text[len(body) :] != _SUM % zlib.crc32(body):
        return None
    with contextlib.suppress(ValueError, RecursionError):  # invalid JSON despite a correct checksum
        line: Line = json.loads(text)
        return line
    return None


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry of a new file to disk, if the system supports this."""
    with contextlib.suppress(OSError):
        file = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(file)
        finally:
            os.close(file)
