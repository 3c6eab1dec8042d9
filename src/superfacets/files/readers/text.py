"""Parse numbers in lines of text with multithreaded C++ functions.

Lines that contain numbers in unusual notation are parsed in Python, which also reports errors.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from ... import _core
from ...base.checks import checked_threads
from ...base.errors import MeshError
from ...base.types import Array, Bools, Bytes, Floats, Ints, Longs
from ..guards import Content

_Kernel = Callable[[Bytes, Longs, Longs, Ints, int], tuple[Array, Longs]]

BLOCK = 1 << 23
"""Number of bytes of text per block of `Lines.blocks`, small to save memory."""

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf(inity)?)", re.I)
_INTEGER = re.compile(rb"[+-]?\d+")


@dataclass(frozen=True, eq=False)
class Lines:
    """A selection of lines of a text, each of which has at least one token.

    Readers of text formats use it to parse many numbers at once: ``Lines.of(data)`` has all lines,
    a slice or mask selects lines, and `parse` returns their numbers as one array.
    """

    text: Bytes  # (B,) complete text
    starts: Longs  # (L,) offset of the first token of each line
    ends: Longs  # (L,) offset of the end of each line, before its comment and newline
    counts: Ints  # (L,) number of tokens, which are separated by whitespace

    @classmethod
    def of(cls, data: Content, *, begin: int = 0, end: int = 2**62, comment: bytes = b"") -> Lines:
        r"""Find all lines of `data`, from byte `begin` to byte `end`, that have a token.

        Lines end at ``\n``, or at ``\r`` in old files without ``\n``. The character `comment`
        begins a comment, which ends with the line and is skipped.
        """
        return cls._between(_plain(data), begin, end, comment)

    @classmethod
    def blocks(cls, data: Content, *, comment: bytes = b"") -> Iterator[Lines]:
        """Yield the same lines as `of`, in blocks, to save memory."""
        data = _plain(data)
        for end in range(BLOCK, len(data) + BLOCK, BLOCK) or [0]:
            begin = (data.find(b"\n", end - BLOCK - 1) + 1 or len(data)) if end > BLOCK else 0
            yield cls._between(data, begin, end, comment)

    @classmethod
    def _between(cls, data: Content, begin: int, end: int, comment: bytes) -> Lines:
        """Find the lines that begin at bytes `begin` to `end` - 1."""
        text, character = np.frombuffer(data, dtype=np.uint8), ord(comment) if comment else 0
        stop = min(end, len(text))
        found = _core.scan_lines(text, min(begin, stop), stop, character, checked_threads(None))
        return cls(text, *found)

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, part: slice | Bools) -> Lines:
        return Lines(self.text, self.starts[part], self.ends[part], self.counts[part])

    def content(self, line: int) -> bytes:
        """Return the bytes of one line, from its first token to its end."""
        return self.text[self.starts[line] : self.ends[line]].tobytes()

    def number(self, line: int) -> int:
        """Return the number of a line in the file, counted from 1."""
        return 1 + int(np.count_nonzero(self.text[: self.starts[line]] == ord("\n")))

    def refuse(self, is_wrong: Bools, expected: str) -> None:
        """Raise a MeshError about the token count of the first line where `is_wrong` is true."""
        if is_wrong.any():
            line = int(np.argmax(is_wrong))
            raise MeshError(f"line {self.number(line)}: {expected}, got {self.counts[line]}")

    def keywords(self, words: Sequence[bytes], *, any_case: bool = False) -> npt.NDArray[np.int8]:
        """Return the index of each line's first token in `words`; ``len(words)`` if not found.

        If `any_case` is true, letter case is ignored, and `words` must be in lower case.
        """
        names = [word.decode("ascii") for word in words]
        return _core.match_keywords(
            self.text, self.starts, self.ends, names, any_case, checked_threads(None)
        )

    def after_keyword(self, mask: Bools, keyword: bytes) -> Lines:
        """Return the lines where `mask` is true, without their first token, the keyword."""
        lines = self[mask]
        return Lines(self.text, lines.starts + len(keyword), lines.ends, lines.counts - 1)

    def parse(self, dtype: type[np.float64] | type[np.int64]) -> Array:
        """Return all numbers, flat, or raise a MeshError if a token is not a number.

        The message has the line number. Decimal numbers are rounded to the nearest double. Integers
        are int32 if all of them fit, otherwise int64. Integers beyond int64 are clipped.
        """
        if dtype is np.float64:
            return self._parse([_core.parse_doubles], _read_double)
        return self._parse([_core.parse_integers, _core.parse_long_integers], _read_integer)

    def parse_vertices(self) -> Floats:
        """Return the first three numbers of each line, (L, 3); a weight or color may follow."""
        self.refuse(self.counts < 3, "a vertex needs 3 coordinates")
        return table(self.parse(np.float64), self.counts, 3)

    def parse_corners(self) -> Array:
        """Return the vertex index of each corner: 7 for ``7``, ``7/2``, ``7//3`` and ``7/2/3``.

        The result is flat, with the same types and errors as in `parse`.
        """
        return self._parse([_core.parse_corners, _core.parse_long_corners], _read_corner)

    def parse_second_indices(self) -> Array:
        """Return the second index of each corner: 2 for ``7/2`` and ``7/2/3``; 0 if missing."""
        kernels: list[_Kernel] = [_core.parse_second_indices, _core.parse_long_second_indices]
        return self._parse(kernels, partial(_read_corner, place=1))

    def parse_integers_or_floats(self) -> Array:
        """Return all numbers, flat: integers if all are written as integers, otherwise float64."""
        if len(self) and b"." in self.content(0):
            return self.parse(np.float64)
        try:
            return self.parse(np.int64)
        except MeshError:
            return self.parse(np.float64)

    def _parse(self, kernels: Sequence[_Kernel], read_token: Callable[[bytes], float]) -> Array:
        """Try C++ kernels in turn; `read_token` parses the lines that none of them can parse."""
        tokens = self.text, self.starts, self.ends, self.counts
        for kernel in kernels:
            values, left_out = kernel(*tokens, checked_threads(None))
            if not len(left_out):
                return values
        firsts = np.cumsum(self.counts, dtype=np.int64) - self.counts
        for line in left_out.tolist():
            try:
                numbers = [read_token(token) for token in self.content(line).split()]
            except ValueError as error:
                raise MeshError(f"line {self.number(line)}: {error}") from None
            values[firsts[line] : firsts[line] + len(numbers)] = numbers
        return values


def _read_double(token: bytes) -> float:
    if not _NUMBER.fullmatch(token):
        raise ValueError(f"expected a number, got {shown(token)}")
    return float(token)


def _read_integer(token: bytes) -> int:
    """Parse an integer and clip it to int64; `int` would refuse more than 4,300 digits."""
    if not _INTEGER.fullmatch(token):
        raise ValueError(f"expected an integer, got {shown(token)}")
    digits = token.lstrip(b"+-").lstrip(b"0")
    size = int(digits[:20] or b"0")  # 20 digits are always outside the range of int64
    return -min(size, 2**63) if token.startswith(b"-") else min(size, 2**63 - 1)


def _read_corner(token: bytes, place: int = 0) -> int:
    index, *others = token.split(b"/")
    if not index:
        raise ValueError("a corner has no vertex index")
    indices = [_read_integer(index), *(_read_integer(other) if other else 0 for other in others)]
    return indices[place] if place < len(indices) else 0


def shown(token: bytes | str) -> str:
    """Return text from a file, shortened, escaped and in quotes; readers use it in messages."""
    return reprlib.repr(token.decode("latin-1") if isinstance(token, bytes) else token)


def _plain(data: Content) -> Content:
    """Return a text without byte order mark and padding, whose lines end in newlines."""
    if data[:3] == b"\xef\xbb\xbf":
        data = data[3:]
    if data[-1:] == b"\0":  # some archives pad files with zeros
        data = data[:].rstrip(b"\0")
    return data if data.find(b"\n") >= 0 else data[:].replace(b"\r", b"\n")


def table(values: Array, counts: Ints, width: int) -> Array:
    """Return the first `width` values of each row; row i has ``counts[i] >= width`` values."""
    if len(values) == 0:
        return values.reshape(0, width)
    if counts.min() == counts.max():
        return values.reshape(len(counts), -1)[:, :width]
    first = np.cumsum(counts, dtype=np.int64) - counts
    chosen: Array = values[first[:, np.newaxis] + np.arange(width)]
    return chosen


def runs(starts: Array, lengths: Array) -> Longs:
    """Concatenate runs of indices; each run is start, start + 1, ..., start + length - 1."""
    lengths = lengths.astype(np.int64, copy=False)
    return np.repeat(starts - np.cumsum(lengths) + lengths, lengths) + np.arange(int(lengths.sum()))


def as_integers(values: Array, what: str) -> Array:
    """Return values as integers of any size; readers use it for indices that files store as floats.

    Arrays of integers are returned unchanged. Raises a MeshError that `what` must be integers if a
    value is not a whole number of magnitude at most 2**53.
    """
    if values.dtype.kind in "iu":
        return values
    with np.errstate(invalid="ignore"):  # signaling NaNs
        # Up to 2**53, float64 represents all integers exactly.
        is_whole = (values == np.floor(values)) & (np.abs(values) <= 2.0**53)
    if not is_whole.all():
        raise MeshError(f"{what} must be integers, got {values[~is_whole].flat[0]!s}")
    return values.astype(np.int64)
