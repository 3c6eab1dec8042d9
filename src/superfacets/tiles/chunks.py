"""Stage 0 on disk: read the input in chunks, weld vertices, and sort the cells by Morton code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints, Longs
from .._validate import MAX_CELLS
from ..batches.mapping import Run
from ..errors import MeshError
from ..io.readers.pieces import Pieces
from ..io.tables import Rows
from ..workers.scratch import Scratch
from .part import Part
from .store import RANGE


@dataclass(frozen=True)
class BlockRows:
    """Table in a scratch folder, with one array on disk for every `size` rows."""

    scratch: Scratch
    name: str
    size: int
    n_rows: int

    def read(self, begin: int, end: int) -> Array:
        """Return rows `begin` to `end` - 1 of the table."""
        parts = []
        for block in range(begin // self.size, -(-end // self.size)):
            first = block * self.size
            rows = max(begin, first) - first, min(first + self.size, end) - first
            parts.append(self.scratch.load(f"{self.name}/{block}", *rows))
        return np.concatenate(parts)


def weld(
    run: Run, scratch: Scratch, vertices: Rows, size: int, n_threads: int, name: str
) -> BlockRows | None:
    """Return, for each vertex, the lowest vertex at its position, or None if all positions differ.

    Coordinates 0.0 and -0.0 are equal. Only about `size` vertices are in memory at a time: vertices
    are split into buckets by a hash of the position, and each bucket is welded separately. A
    MeshError reports the first vertex that is not finite as ``name[i]``.
    """
    n_blocks = -(-vertices.n_rows // size)
    n_buckets = 1 << (n_blocks - 1).bit_length()
    run.all(_fill_buckets, scratch, n_blocks, vertices, size, n_buckets, name)
    are_shared = any(run.all(_weld_bucket, scratch, n_buckets, size, n_blocks, n_threads))
    if are_shared:
        run.all(_list_block, scratch, n_blocks, vertices.n_rows, size, n_buckets)
    scratch.remove_folder("buckets")
    scratch.remove_folder("welded")
    return BlockRows(scratch, "representatives", size, vertices.n_rows) if are_shared else None


def _fill_buckets(
    scratch: Scratch, block: int, vertices: Rows, size: int, n_buckets: int, name: str
) -> None:
    """Write the vertices of a block, sorted by bucket; raise a MeshError if one is not finite."""
    begin = block * size
    positions = vertices.read(begin, min(begin + size, vertices.n_rows))
    is_finite = np.isfinite(positions).all(axis=1)
    if not is_finite.all():
        first = int(np.argmin(is_finite))
        raise MeshError(
            f"{name}[{begin + first}] must be finite, got"
            f" {positions[first].astype(np.float64).tolist()}"
        )
    buckets = _buckets_of(positions.astype(np.float64), n_buckets)
    order = np.argsort(buckets, kind="stable").astype(np.uint32)
    starts = np.zeros(n_buckets + 1, np.int64)
    np.cumsum(np.bincount(buckets, minlength=n_buckets), out=starts[1:])
    scratch.save(f"buckets/{block}/starts", starts)
    scratch.save(f"buckets/{block}/vertices", order)
    scratch.save(f"buckets/{block}/positions", positions[order])


def _buckets_of(positions: Floats, n_buckets: int) -> Array:
    """Return a hash of each position, 0 to `n_buckets` - 1; `n_buckets` is a power of two."""
    if n_buckets == 1:
        return np.zeros(len(positions), np.uint16)
    bits = (positions + 0.0).view(np.uint64).reshape(-1, 3)  # + 0.0 turns -0.0 into 0.0
    # Only the upper bits of a product depend on all bits of the coordinate, so they are shifted
    # down and mixed once more.
    factors = (0x9E3779B97F4A7C15, 0xD6E8FEB86659FD93, 0xA0761D6478BD642F)
    mixed = np.zeros(len(bits), np.uint64)
    for axis, factor in enumerate(factors):
        mixed ^= bits[:, axis] * np.uint64(factor)
        mixed ^= mixed >> np.uint64(29)
        mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed >>= np.uint64(64 - (n_buckets - 1).bit_length())
    return mixed.astype(np.uint16 if n_buckets <= 1 << 16 else np.uint32)


def _weld_bucket(scratch: Scratch, bucket: int, size: int, n_blocks: int, n_threads: int) -> bool:
    """Write a pair (vertex, lowest vertex) for each duplicate in a bucket.

    A vertex is a duplicate if a lower vertex has the same position. Returns whether there are any
    duplicates.
    """
    vertices, positions = [], []
    for block in range(n_blocks):
        begin, end = scratch.load(f"buckets/{block}/starts", bucket, bucket + 2).tolist()
        if begin == end:
            continue
        found = scratch.load(f"buckets/{block}/vertices", begin, end)
        vertices.append(found.astype(np.int64) + block * size)
        positions.append(scratch.load(f"buckets/{block}/positions", begin, end))
    if not vertices:
        return False
    numbers = np.concatenate(vertices)
    points = np.concatenate(positions).astype(np.float64)
    lowest = _core.weld_vertices(points, n_threads)
    shared = np.flatnonzero(lowest != np.arange(len(lowest)))
    if len(shared):
        pairs = np.stack([numbers[shared], numbers[lowest[shared]]], axis=1)
        starts = np.searchsorted(pairs[:, 0], size * np.arange(n_blocks + 1))
        scratch.save(f"welded/{bucket}/starts", starts)
        scratch.save(f"welded/{bucket}/pairs", pairs)
    return len(shared) > 0


def _list_block(scratch: Scratch, block: int, n_vertices: int, size: int, n_buckets: int) -> None:
    """Write, for each vertex of a block, the lowest vertex at its position."""
    begin = block * size
    lowest = np.arange(begin, min(begin + size, n_vertices), dtype=np.int64)
    for bucket in range(n_buckets):
        if scratch.has(f"welded/{bucket}/pairs"):
            first, last = scratch.load(f"welded/{bucket}/starts", block, block + 2).tolist()
            pairs = scratch.load(f"welded/{bucket}/pairs", first, last)
            lowest[pairs[:, 0] - begin] = pairs[:, 1]
    scratch.save(f"representatives/{block}", lowest)


LOW_BITS = 15
"""Number of lower bits of a Morton code: half of its 30 bits. A histogram of the upper bits is used
to find where tiles begin. If a tile begins between codes with equal upper bits, another histogram
counts the lower bits of these codes."""


@dataclass(frozen=True)
class Chunks:
    """Cells (faces or points) of the input, split in input order into chunks of `size` cells."""

    pieces: Pieces
    lowest: Rows | None  # lowest vertex at each vertex's position; None if vertices are not welded
    size: int
    n_threads: int

    @classmethod
    def welded(
        cls, pieces: Pieces, scratch: Scratch, tile_cells: int, run: Run, n_threads: int,
        welds: bool = True,
    ) -> Chunks:  # fmt: skip
        """Check the input, and weld vertices at equal positions if `welds` is true.

        Raises a MeshError if there are too many cells or if a position is not finite.
        """
        is_cloud = pieces.corners is None
        whole, cells = ("cloud", "points") if is_cloud else ("mesh", "faces")
        if pieces.n_cells > MAX_CELLS:
            raise MeshError(
                f"the {whole} has {pieces.n_cells} {cells}; at most {MAX_CELLS} are supported"
            )
        size = -(-tile_cells // RANGE) * RANGE
        name = "points" if is_cloud else "vertices"
        lowest = weld(run, scratch, pieces.points, size, n_threads, name)
        return cls(pieces, lowest if welds else None, size, n_threads)

    @property
    def n_chunks(self) -> int:
        """Number of chunks."""
        return -(-self.pieces.n_cells // self.size)

    def range(self, chunk: int) -> tuple[int, int]:
        """Return the first cell of a chunk and the first cell of the next chunk."""
        return chunk * self.size, min((chunk + 1) * self.size, self.pieces.n_cells)

    def save_run(
        self, scratch: Scratch, chunk: int, part: Part, positions: Floats, box: Floats
    ) -> Ints:
        """Write the cells of a chunk to ``runs/{chunk}``, sorted by their Morton codes in `box`.

        The sorted chunk is called a run. Returns the histogram of the upper bits of the codes,
        (2^15,).
        """
        low, high = map(tuple, box)
        codes = _core.morton_codes(positions, low, high, self.n_threads)
        order = _stable_order(codes)
        part = part.take(order)
        part.columns["codes"] = codes[order]
        part.save(scratch, f"runs/{chunk}")
        return np.bincount(codes >> LOW_BITS, minlength=1 << LOW_BITS).astype(np.int32)


def find_cuts(scratch: Scratch, counts: Ints, starts: Longs) -> Longs:
    """Return the first row of each tile in each sorted run, (T + 1, chunks).

    The last row of the result contains the lengths of the runs. `counts`, (chunks, 2^15), contains
    the histogram of the upper code bits of each run. `starts` contains the curve index (rank in the
    whole order) at which each tile begins.
    """
    before = np.zeros((len(counts), counts.shape[1] + 1), np.int32)
    np.cumsum(counts, axis=1, out=before[:, 1:])
    all_before = before.sum(axis=0, dtype=np.int64)
    cuts = np.zeros((len(starts), len(counts)), np.int64)
    cuts[-1] = before[:, -1]
    for tile in range(1, len(starts) - 1):
        upper = int(np.searchsorted(all_before, starts[tile], side="right")) - 1
        n_left = int(starts[tile] - all_before[upper])
        cuts[tile] = before[:, upper]
        if n_left:
            ranges = before[:, upper : upper + 2].astype(np.int64)
            cuts[tile] += _cut_within(scratch, ranges, n_left)
    return cuts


def _cut_within(scratch: Scratch, ranges: Longs, n_left: int) -> Longs:
    """Return how many of the first `n_left` cells in the order (code, run, row) are in each run.

    Only the rows of each run in `ranges` (first row and last row + 1) are used. All codes in these
    rows have the same upper bits.
    """

    def codes_of(chunk: int) -> Array:
        codes: Array = scratch.load(f"runs/{chunk}/codes", *ranges[chunk].tolist())
        return codes & np.uint32((1 << LOW_BITS) - 1)

    chunks = np.flatnonzero(ranges[:, 0] < ranges[:, 1]).tolist()
    totals = np.zeros(1 << LOW_BITS, np.int64)
    for chunk in chunks:
        totals += np.bincount(codes_of(chunk), minlength=len(totals))
    ends = np.cumsum(totals)
    code = int(np.searchsorted(ends, n_left))  # highest code of the first `n_left` cells
    n_equal = n_left - int(ends[code] - totals[code])
    taken = np.zeros(len(ranges), np.int64)
    for chunk in chunks:
        first, last = np.searchsorted(codes_of(chunk), [code, code + 1]).tolist()
        n_more = min(n_equal, last - first)
        n_equal -= n_more
        taken[chunk] = first + n_more
    return taken


def read_cut(scratch: Scratch, cuts: Longs, names: Sequence[str]) -> Part:
    """Return the cells of a tile, sorted by (code, run), with a column ``codes``.

    `cuts`, (2, chunks), contains the first row of the tile in each run, and the row after the last.
    """
    parts = [
        Part.load(scratch, f"runs/{chunk}", ("codes", *names), *cuts[:, chunk].tolist())
        for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist()
    ]
    part = Part.joined(parts)
    del parts
    return part.take(_stable_order(part.columns["codes"]))


def _stable_order(codes: Array) -> Longs:
    """Return the indices that sort uint32 codes stably.

    Codes are sorted in two passes, because NumPy sorts 16-bit keys much faster.
    """
    order = np.argsort((codes & 0xFFFF).astype(np.uint16), kind="stable")
    upper = (codes >> 16).astype(np.uint16)
    return order[np.argsort(upper[order], kind="stable")]
