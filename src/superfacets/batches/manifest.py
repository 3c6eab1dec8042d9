"""Read and write the manifest of a batch, which has one line of JSON per processed file."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..io.atomic import atomic_outputs, open_own
from .jobs import Record


class Manifest:
    """A file of records, which only one process may use at a time, in a `with` block.

    `records` maps the name of each input file to its last record. `append` returns when the record
    is on the disk. Damaged lines are ignored, for example an incomplete last line from a killed
    process. Damaged and replaced lines are removed before the first `append`, and at the end of the
    `with` block if it raises no exception. `notes` contains a message for each damaged line, except
    for an incomplete last line.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None
        self.notes: list[str] = []
        self.records, self._is_tidy = _read(path, self.notes)

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None
        if not self._is_tidy and kind is None:
            self._rewrite()

    def append(self, record: Record) -> None:
        """Add a record. It replaces an earlier record of the same name.

        If the record cannot be written, raises an OSError and leaves the file unchanged.
        """
        line = json.dumps(record).encode() + b"\n"
        if self._file is None:
            if not self._is_tidy:
                self._rewrite()
            self._file = open_own(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        size = os.fstat(self._file).st_size
        try:
            _write_all(self._file, line)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise OSError(error.errno, error.strerror, str(self._path)) from None
        self._is_tidy = self._is_tidy and record["name"] not in self.records
        self.records[record["name"]] = record

    def _rewrite(self) -> None:
        lines = (json.dumps(record) + "\n" for record in self.records.values())
        with atomic_outputs([self._path]) as (partial,), partial.open("wb") as file:
            file.write("".join(lines).encode())
            file.flush()
            os.fsync(file.fileno())
        self._is_tidy = True


def _write_all(file: int, data: bytes) -> None:
    """Write all bytes to the disk in a loop, because `os.write` may write only some of them."""
    while data:
        data = data[os.write(file, data) :]
    os.fsync(file)


def _read(path: Path, notes: list[str]) -> tuple[dict[str, Record], bool]:
    """Return the last record of each name, and whether the file contains nothing else.

    Messages about damaged lines are appended to `notes`.
    """
    records: dict[str, Record] = {}
    is_tidy = True
    for number, line in enumerate(_content(path).splitlines(keepends=True), 1):
        record = _record_of(line)
        if record is None or record["name"] in records:
            is_tidy = False
        if record is not None:
            records[record["name"]] = record
        elif line.endswith(b"\n"):
            notes.append(f"{path}: line {number} is damaged: its input file is processed again")
    return records, is_tidy


def _content(path: Path) -> bytes:
    try:
        file = open_own(path, os.O_RDONLY)
    except FileNotFoundError:
        return b""
    with os.fdopen(file, "rb") as reader:
        return reader.read()


def _record_of(line: bytes) -> Record | None:
    """Return the record in a line, or None if the line is incomplete or damaged."""
    try:
        record = json.loads(line)
    except (ValueError, RecursionError):
        return None
    is_record = (
        isinstance(record, dict)
        and isinstance(record.get("name"), str)
        and isinstance(record.get("outputs", {}), dict)
    )
    return record if is_record and line.endswith(b"\n") else None
