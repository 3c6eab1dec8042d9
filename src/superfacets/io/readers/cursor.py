"""Reading position in files of header lines and blocks of numbers, text or binary."""

from __future__ import annotations

import reprlib
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..._types import Array, Longs
from ...errors import MeshError
from ..guards import Content, counted
from .text import Lines, as_integers, split_lines

__all__ = ["Cursor", "as_count", "shown"]


class Cursor:
    """Reading position in a file; each line and each block of numbers moves it on.

    Parameters
    ----------
    data : bytes or mmap
        The whole file.

    Attributes
    ----------
    place : int
        The byte that is read next.
    byte_order : str
        Of binary numbers, ``"<"`` or ``">"``; empty where numbers are text.
    """

    def __init__(self, data: Content) -> None:
        self.data = data
        self.place = 0
        self.byte_order: Literal["", "<", ">"] = ""

    @cached_property
    def _lines(self) -> tuple[Lines, Longs]:
        """Lines of a text, and the cumulative number of tokens."""
        lines = split_lines(self.data)
        return lines, np.cumsum(lines.counts, dtype=np.int64)

    def any_line(self) -> bytes:
        """The next line, perhaps blank, stripped. The last one need not end in a newline."""
        newline = self.data.find(b"\n", self.place)
        end = newline if newline >= 0 else len(self.data)
        line, self.place = self.data[self.place : end], min(end + 1, len(self.data))
        return line.strip()

    def line(self) -> bytes:
        """The next line that is not blank; empty at the end of the file."""
        while self.place < len(self.data):
            if line := self.any_line():
                return line
        return b""

    def counts(self, n: int, what: str) -> list[int]:
        """The first `n` numbers of the next line; a MeshError if there are fewer."""
        tokens = self.line().split()
        if len(tokens) < n:
            raise MeshError(f"{what} are missing: is the file cut?")
        return [as_count(token, what) for token in tokens]

    def numbers(self, n: int, dtype: str, what: str, unit: str = "number") -> Array:
        """The next `n` numbers; a MeshError, before memory is taken, if the file has fewer.

        Text gives float64, rounded to the declared type, or integers that are not.
        """
        stored = np.dtype(dtype)
        if not self.byte_order:
            return self._parsed(n, stored, what)
        n_left = (len(self.data) - self.place) // stored.itemsize
        if n > n_left:
            raise _too_few(n, n_left, what, unit)
        found = np.frombuffer(self.data, stored.newbyteorder(self.byte_order), n, self.place)
        self.place += n * stored.itemsize
        return found.astype(stored)

    def rows(self, n: int, what: str) -> Lines:
        """The next `n` lines."""
        lines, _ = self._lines
        first = int(np.searchsorted(lines.starts, self.place))
        if n > len(lines) - first:
            raise MeshError(
                f"{counted(n, 'line')} of {what} are declared, but {len(lines) - first} are there:"
                " is the file cut?"
            )
        found = lines[first : first + n]
        if n:
            self.place = int(found.ends[-1])
        return found

    def _parsed(self, n: int, stored: np.dtype[Any], what: str) -> Array:
        lines, totals = self._lines
        first = int(np.searchsorted(lines.starts, self.place))
        before = int(totals[first - 1]) if first else 0
        last = int(np.searchsorted(totals, before + n))
        if n and last == len(lines):
            raise _too_few(n, int(totals[-1]) - before, what)
        if n and totals[last] != before + n:
            raise MeshError(f"line {lines.number(last)}: something follows the last of {what}")
        part = self.rows(last + 1 - first if n else 0, what)
        if stored.kind != "f":
            return as_integers(part.parse_integers_or_floats(), what)
        with np.errstate(over="ignore", invalid="ignore"):
            return part.parse(np.float64).astype(stored)


def _too_few(n: int, n_left: int, what: str, unit: str = "number") -> MeshError:
    return MeshError(
        f"{counted(n, unit)} of {what} are declared, but at most {n_left} are there:"
        " is the file cut?"
    )


def as_count(token: bytes | str, what: str) -> int:
    """A token as an integer; a MeshError if it is none, or larger than any file."""
    if not token.isdigit() or len(token) > 18 or not token.isascii():
        raise MeshError(f"{what} must be whole numbers, got {shown(token)}")
    return int(token)


def shown(token: bytes | str) -> str:
    """Text from a file, made safe to show in a message."""
    return reprlib.repr(token.decode("latin-1") if isinstance(token, bytes) else token)
