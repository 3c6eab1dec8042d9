"""Numbers in lines of text, found and parsed without a Python loop over lines.

Every text format here is read through `Lines`: where the lines that hold something begin and end,
and how many tokens each has. Numbers are parsed many lines at once, by `numpy.fromstring`, which
rounds decimals correctly, and which is only trusted if it finds one number per token.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ..errors import MeshError

__all__ = ["Lines", "as_integers", "iterate_lines", "split_lines", "table", "token_start_mask"]

Index = npt.NDArray[np.int64]

BLOCK = 1 << 20
"""Bytes scanned at a time: the masks of a block stay in the cache, and memory stays small."""

LAST_BLANK = ord(" ")
"""Bytes up to this one separate tokens."""

EXACT = 2.0**53
"""Beyond this float64 skips integers."""

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf(inity)?)", re.I)
_INTEGER = re.compile(rb"[+-]?\d+")


@dataclass(frozen=True, eq=False)
class Lines:
    """Some lines of a text, each with at least one token.

    Parameters
    ----------
    text : (B,) uint8
        The whole text.
    starts, ends : (L,) int64
        First byte of the first token, and the byte of the newline, for each line.
    counts : (L,) int64
        Tokens, which are separated by blanks.
    numbers : (L,) int64
        Line numbers in the file, from 1.
    """

    text: npt.NDArray[np.uint8]
    starts: Index
    ends: Index
    counts: Index
    numbers: Index

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, part: slice) -> Lines:
        return replace(
            self,
            starts=self.starts[part],
            ends=self.ends[part],
            counts=self.counts[part],
            numbers=self.numbers[part],
        )

    def content(self, line: int) -> bytes:
        """Bytes of one line, from its first token on."""
        return self.text[self.starts[line] : self.ends[line]].tobytes()

    def having_keyword(self, keyword: bytes, *, any_case: bool = False) -> npt.NDArray[np.bool_]:
        """Mask of the lines whose first token is `keyword` (in lower case if `any_case`)."""
        fold = np.uint8(0x20 if any_case else 0)
        found: Index = np.arange(len(self))
        for place, letter in enumerate(keyword):
            # A line that was too short for its next letter has left: `starts + place` is inside.
            found = found[self.text[self.starts[found] + place] | fold == letter]
        found = found[self.text[self.starts[found] + len(keyword)] <= LAST_BLANK]
        mask = np.zeros(len(self), dtype=bool)
        mask[found] = True
        return mask

    def after_keyword(self, mask: npt.NDArray[np.bool_], keyword: bytes) -> Lines:
        """The lines of `mask` without their first token, on a text where all else is blank."""
        starts, ends = self.starts[mask] + len(keyword), self.ends[mask]
        is_full = starts < ends
        border = np.zeros(len(self.text), dtype=np.int8)  # 1 where a line begins, -1 where it ends
        border[starts[is_full]] = 1
        border[ends[is_full]] = -1
        is_inside = np.cumsum(border, dtype=np.int8).view(bool)
        text = np.where(is_inside, self.text, np.uint8(LAST_BLANK))
        return Lines(text, starts, ends, self.counts[mask] - 1, self.numbers[mask])

    def parse(self, dtype: type[np.float64] | type[np.int64]) -> npt.NDArray[Any]:
        """All numbers, flat; a MeshError that names the line if a token is not a number.

        The lines must follow each other in the text with nothing but blanks between them.
        """
        n_tokens = int(self.counts.sum())
        if n_tokens == 0:  # fromstring finds a -1 in blanks
            return np.empty(0, dtype=dtype)
        region = self.text[self.starts[0] : self.ends[-1]]
        try:
            values = np.fromstring(region.tobytes(), dtype=dtype, sep=" ")
        except (ValueError, DeprecationWarning):  # numpy 1.26 warns, and stops early
            values = np.empty(0, dtype=dtype)
        if len(values) != n_tokens or (dtype is np.int64 and _has_lone_sign(region)):
            _raise_bad_token(self, dtype)
        return values

    def parse_integers_or_floats(self) -> npt.NDArray[Any]:
        """All numbers, flat: int64 (6 times as fast) if all are written as such, else float64."""
        if len(self) and np.any(self.text[self.starts[0] : self.ends[-1]] == ord(".")):
            return self.parse(np.float64)
        try:
            return self.parse(np.int64)
        except MeshError:
            return self.parse(np.float64)


def split_lines(data: bytes, *, comment: bytes | None = None) -> Lines:
    r"""Find the lines of `data` that hold a token.

    Lines end at ``\n``, or at ``\r`` in old files that have no ``\n``. What follows `comment` on a
    line is left out.
    """
    data = _clean(data, comment)
    blocks = list(_scan_blocks(data))
    return Lines(
        np.frombuffer(data, dtype=np.uint8),
        np.concatenate([lines.starts + begin for begin, lines in blocks]),
        np.concatenate([lines.ends + begin for begin, lines in blocks]),
        np.concatenate([lines.counts for _, lines in blocks]),
        np.concatenate([lines.numbers for _, lines in blocks]),
    )


def iterate_lines(data: bytes, *, comment: bytes | None = None) -> Iterator[Lines]:
    """The same lines as of `split_lines`, block by block, each block with a text of its own.

    Work on small texts is several times as fast: they stay in the cache, and reuse memory.
    """
    return (lines for _, lines in _scan_blocks(_clean(data, comment)))


def _clean(data: bytes, comment: bytes | None) -> bytes:
    """Text without comments, all of whose lines end, at newlines."""
    data = data.removeprefix(b"\xef\xbb\xbf")  # a byte order mark
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    if comment is not None and comment in data:
        data = re.sub(re.escape(comment) + rb"[^\n]*", b"", data)
    return data + b"\n"


def _scan_blocks(data: bytes) -> Iterator[tuple[int, Lines]]:
    """The lines of each block of the text, and where the block begins."""
    text = np.frombuffer(data, dtype=np.uint8)
    begin, n_lines = 0, 0
    while begin < len(data):
        stop = data.find(b"\n", min(begin + BLOCK, len(data) - 1)) + 1
        newlines = np.flatnonzero(text[begin:stop] == ord("\n"))
        yield begin, _scan(text[begin:stop], newlines, n_lines)
        begin, n_lines = stop, n_lines + len(newlines)


def _scan(text: npt.NDArray[np.uint8], newlines: Index, n_lines_before: int) -> Lines:
    """The lines of a text that ends with a newline."""
    token_starts = np.flatnonzero(token_start_mask(text))
    tokens_before_end = np.searchsorted(token_starts, newlines)
    counts = np.diff(tokens_before_end, prepend=0)
    is_full = counts > 0
    first_tokens = (tokens_before_end - counts)[is_full]
    numbers = np.flatnonzero(is_full) + (n_lines_before + 1)
    return Lines(text, token_starts[first_tokens], newlines[is_full], counts[is_full], numbers)


def token_start_mask(text: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """Mask of the bytes where a token begins: those after a blank, or first, and not blank."""
    is_blank = text <= LAST_BLANK
    is_start = ~is_blank
    is_start[1:] &= is_blank[:-1]
    return is_start


def _has_lone_sign(region: npt.NDArray[np.uint8]) -> bool:
    """Whether a + or - has no digit after it: fromstring takes such a token for the integer 0."""
    signs = np.flatnonzero((region == ord("-")) | (region == ord("+")))
    following = region[np.minimum(signs + 1, len(region) - 1)]
    return bool(np.any((following < ord("0")) | (following > ord("9"))))


def _raise_bad_token(lines: Lines, dtype: type[np.float64] | type[np.int64]) -> NoReturn:
    """Raise a MeshError that names the first line with a token that is no number."""
    pattern, kind = (_INTEGER, "an integer") if dtype is np.int64 else (_NUMBER, "a number")
    for line, number in enumerate(lines.numbers.tolist()):
        for token in lines.content(line).split():
            if not pattern.fullmatch(token):
                text = reprlib.repr(token.decode("latin-1"))
                raise MeshError(f"line {number}: expected {kind}, got {text}")
    raise MeshError(f"the lines from {int(lines.numbers[0])} on do not hold numbers only")


def table(values: npt.NDArray[Any], counts: Index, width: int) -> npt.NDArray[Any]:
    """First `width` values of each row; row i has ``counts[i] >= width`` of the flat values."""
    if len(values) == width * len(counts):
        return values.reshape(-1, width)
    first = np.cumsum(counts) - counts
    chosen: npt.NDArray[Any] = values[first[:, np.newaxis] + np.arange(width)]
    return chosen


def as_integers(values: npt.NDArray[Any], what: str) -> npt.NDArray[Any]:
    """`values` as integers; a MeshError that calls them `what` if one has a fraction."""
    if values.dtype.kind in "iu":
        return values
    is_whole = (values == np.floor(values)) & (np.abs(values) <= EXACT)
    if not is_whole.all():
        raise MeshError(f"{what} must be integers, got {values[~is_whole].flat[0]!s}")
    return values.astype(np.int64)
