"""Read and write the manifest of a batch, which has one line of JSON per processed file."""

from __future__ import annotations

import json
import os
from pathlib import Path

from superfacets.kit import atomic_outputs, open_own

from .jobs import Record


class Manifest:
    """A file of records, which only one process may use at a time, in a `with` block.

    `records` maps the name of each input file to its last record. Damaged lines are ignored, for
    example an incomplete last line from a killed process; `notes` has a message for each other
    damaged line. Damaged and replaced lines are removed before the first `append`, and at the end
    of the `with` block if it raises no exception. While this process processes files itself, the
    file also has a line for each file without a record, with the number of processes that began it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None
        self.notes: list[str] = []
        self.records: dict[str, Record] = {}
        self._begun: dict[str, int] = {}
        self._is_tidy = True
        for number, line in enumerate(_content(path).splitlines(keepends=True), 1):
            record = _record_of(line)
            self._is_tidy &= record is not None and "begun" not in record
            if record is not None:
                self._take(record)
            elif line.endswith(b"\n"):
                self.notes.append(
                    f"{path}: line {number} is damaged: its input file is processed again"
                )

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None
        if not self._is_tidy and kind is None:
            self._rewrite()

    def append(self, record: Record) -> None:
        """Write a record to the disk. It replaces an earlier record of the same name.

        If the record cannot be written, raises an OSError and leaves the file unchanged.
        """
        self._write(record)
        self._take(record)

    def count_begin(self, name: str, change: int = 1) -> None:
        """Write to the disk that this process begins with a file; with -1, take this back."""
        self._write({"name": name, "begun": self.n_begun(name) + change})
        self._begun[name] = self.n_begun(name) + change
        self._is_tidy = False

    def n_begun(self, name: str) -> int:
        """Return how many processes have ended while processing a file that has no record."""
        return self._begun.get(name, 0)

    def _take(self, record: Record) -> None:
        name = record["name"]
        if "begun" in record:
            self._begun[name] = record["begun"]
        else:
            self._is_tidy &= name not in self.records
            self._begun.pop(name, None)
            self.records[name] = record

    def _write(self, content: Record) -> None:
        if self._file is None:
            if not self._is_tidy:
                self._rewrite()
            self._file = open_own(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        size = os.fstat(self._file).st_size
        line = json.dumps(content).encode() + b"\n"
        try:
            while line:  # `os.write` may write only some of the bytes
                line = line[os.write(self._file, line) :]
            os.fsync(self._file)
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


def _content(path: Path) -> bytes:
    try:
        with os.fdopen(open_own(path, os.O_RDONLY), "rb") as reader:
            return reader.read()
    except FileNotFoundError:
        return b""


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
        and isinstance(record.get("begun", 0), int)
    )
    return record if is_record and line.endswith(b"\n") else None
