"""Stage 0 on disk: weld vertices, block by block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from .._types import Array, Floats
from ..errors import MeshError
from ..io.tables import Rows
from .mapping import run_all
from .scratch import Scratch
from .store import Run


@dataclass(frozen=True)
class BlockRows:
    """Rows in a scratch folder, in blocks of equal size."""

    scratch: Scratch
    name: str
    size: int
    n_rows: int

    def read(self, begin: int, end: int) -> Array:
        """Rows begin to end - 1."""
        parts = []
        for block in range(begin // self.size, -(-end // self.size)):
            first = block * self.size
            rows = max(begin, first) - first, min(first + self.size, end) - first
            parts.append(self.scratch.load(f"{self.name}/{block}", *rows))
        return np.concatenate(parts)


def weld(
    run: Run, scratch: Scratch, vertices: Rows, size: int, n_threads: int, name: str
) -> BlockRows | None:
    """The lowest vertex at exactly the position of each (-0.0 is 0.0); None if no two are equal.

    `size` vertices are in memory at a time. They are split into buckets by a hash of the position;
    buckets are welded one by one, and duplicates are listed per block. A MeshError names the first
    vertex that is not finite; `name` is the word for vertices in it.
    """
    n_blocks = -(-vertices.n_rows // size)
    n_buckets = 1 << (n_blocks - 1).bit_length()
    run_all(run, _fill_buckets, scratch, n_blocks, vertices, size, n_buckets, name)
    n_shared = run_all(run, _weld_bucket, scratch, n_buckets, size, n_blocks, n_threads)
    if any(n_shared):
        run_all(run, _list_block, scratch, n_blocks, vertices.n_rows, size, n_buckets)
    scratch.remove_folder("buckets")
    scratch.remove_folder("welded")
    if not any(n_shared):
        return None
    return BlockRows(scratch, "representatives", size, vertices.n_rows)


def _checked_block(vertices: Rows, block: int, size: int, name: str) -> Array:
    """Positions in a block; a MeshError if one is not finite."""
    begin = block * size
    positions = vertices.read(begin, min(begin + size, vertices.n_rows))
    is_finite = np.isfinite(positions).all(axis=1)
    if not is_finite.all():
        first = int(np.argmin(is_finite))
        raise MeshError(
            f"{name}[{begin + first}] is not finite: {positions[first].astype(np.float64).tolist()}"
        )
    return positions


def _fill_buckets(
    scratch: Scratch, block: int, vertices: Rows, size: int, n_buckets: int, name: str
) -> None:
    """Sort the vertices of a block by bucket, stable."""
    positions = _checked_block(vertices, block, size, name)
    buckets = _buckets_of(positions.astype(np.float64), n_buckets)
    order = np.argsort(buckets, kind="stable").astype(np.uint32)
    starts = np.zeros(n_buckets + 1, np.int64)
    np.cumsum(np.bincount(buckets, minlength=n_buckets), out=starts[1:])
    scratch.save(f"buckets/{block}/starts", starts)
    scratch.save(f"buckets/{block}/vertices", order)
    scratch.save(f"buckets/{block}/positions", positions[order])


def _buckets_of(positions: Floats, n_buckets: int) -> Array:
    """A bucket for each position, the same for equal ones; their number is a power of two."""
    if n_buckets == 1:
        return np.zeros(len(positions), np.uint16)
    bits = (positions + 0.0).view(np.uint64).reshape(-1, 3)  # -0.0 becomes 0.0
    # Multiplication brings all bits of a coordinate to the upper ones of the product; the upper
    # bits are then brought down and mixed once more.
    factors = (0x9E3779B97F4A7C15, 0xD6E8FEB86659FD93, 0xA0761D6478BD642F)
    mixed = np.zeros(len(bits), np.uint64)
    for axis, factor in enumerate(factors):
        mixed ^= bits[:, axis] * np.uint64(factor)
        mixed ^= mixed >> np.uint64(29)
        mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed >>= np.uint64(64 - (n_buckets - 1).bit_length())
    return mixed.astype(np.uint16 if n_buckets <= 1 << 16 else np.uint32)


def _weld_bucket(scratch: Scratch, bucket: int, size: int, n_blocks: int, n_threads: int) -> int:
    """Write (duplicate, lowest vertex at its position) pairs of a bucket; return their number."""
    vertices, positions = [], []
    for block in range(n_blocks):
        begin, end = scratch.load(f"buckets/{block}/starts", bucket, bucket + 2).tolist()
        if begin == end:
            continue
        found = scratch.load(f"buckets/{block}/vertices", begin, end)
        vertices.append(found.astype(np.int64) + block * size)
        positions.append(scratch.load(f"buckets/{block}/positions", begin, end))
    if not vertices:
        return 0
    numbers = np.concatenate(vertices)
    points = np.concatenate(positions).astype(np.float64)
    lowest = _core.weld_vertices(points, n_threads)
    shared = np.flatnonzero(lowest != np.arange(len(lowest)))
    if len(shared):
        pairs = np.stack([numbers[shared], numbers[lowest[shared]]], axis=1)
        starts = np.searchsorted(pairs[:, 0], size * np.arange(n_blocks + 1))
        scratch.save(f"welded/{bucket}/starts", starts)
        scratch.save(f"welded/{bucket}/pairs", pairs)
    return len(shared)


def _list_block(scratch: Scratch, block: int, n_vertices: int, size: int, n_buckets: int) -> None:
    """Write the representative of each vertex of a block: the lowest vertex at its position."""
    begin = block * size
    lowest = np.arange(begin, min(begin + size, n_vertices), dtype=np.int64)
    for bucket in range(n_buckets):
        if scratch.has(f"welded/{bucket}/pairs"):
            first, last = scratch.load(f"welded/{bucket}/starts", block, block + 2).tolist()
            pairs = scratch.load(f"welded/{bucket}/pairs", first, last)
            lowest[pairs[:, 0] - begin] = pairs[:, 1]
    scratch.save(f"representatives/{block}", lowest)
