"""Read and write the manifest of a batch, which has one line of JSON per processed file."""

from __future__ import annotations

import json
import os
from pathlib import Path

from superfacets.files.atomic import atomic_outputs, open_own

from .jobs import Record


class Manifest:
    """A file of records, which only one process may use at a time, in a `with` block.

    `records` maps the name of each input file to its last record. `append` returns when the record
    is on the disk. Damaged lines are ignored, for example an incomplete last line from a killed
    process. Damaged and replaced lines are removed before the first `append`, and at the end of the
    `with` block if it raises no exception. `notes` contains a message for each damaged line, except
    for an incomplete last line. While this process processes files itself, the file also has a line
    with the name of each file that has no record yet, and how many processes began with it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None
        self.notes: list[str] = []
        self._begun: dict[str, int] = {}
        self.records, self._is_tidy = _read(path, self.notes, self._begun)

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
        self._write(record)
        self._is_tidy = self._is_tidy and record["name"] not in self.records
        self.records[record["name"]] = record
        self._begun.pop(record["name"], None)

    def begin(self, name: str) -> None:
        """Note on the disk that this process starts to process a file."""
        self._begun[name] = self.n_begun(name) + 1
        self._write({"name": name, "begun": self._begun[name]})
        self._is_tidy = False

    def take_back(self, name: str) -> None:
        """Take back `begin`."""
        self._begun[name] -= 1
        self._write({"name": name, "begun": self._begun[name]})

    def n_begun(self, name: str) -> int:
        """Return how many processes have ended while processing a file that has no record."""
        return self._begun.get(name, 0)

    def _write(self, content: Record) -> None:
        line = json.dumps(content).encode() + b"\n"
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

    def _rewrite(self) -> None:
        begun = ({"name": name, "begun": n} for name, n in self._begun.items() if n)
        lines = (json.dumps(record) + "\n" for record in (*self.records.values(), *begun))
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


def _read(path: Path, notes: list[str], begun: dict[str, int]) -> tuple[dict[str, Record], bool]:
    """Return the last record of each name, and whether the file contains nothing else.

    Messages about damaged lines are appended to `notes`. `begun` gets the last number of each name
    that has no record after it; see `Manifest.n_begun`.
    """
    records: dict[str, Record] = {}
    is_tidy = True
    for number, line in enumerate(_content(path).splitlines(keepends=True), 1):
        record = _record_of(line)
        if record is None or record["name"] in records:
            is_tidy = False
        if record is not None and isinstance(record.get("begun"), int):
            begun[record["name"]] = record["begun"]
            is_tidy = False
        elif record is not None:
            begun.pop(record["name"], None)
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
