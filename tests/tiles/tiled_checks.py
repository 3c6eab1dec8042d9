"""The check that most tests of tiles use."""

import contextlib

import numpy as np
import pytest

import superfacets as sf


def in_memory(cells, n_segments, **options):
    """Return the result of `segment`."""
    return sf.segment(cells, n_segments, **options)


def check(cells, n_segments, tmp_path, tile_sizes=(1 << 14, 4096), **options):
    """Compare the result for each tile size with the result in memory, and return the latter.

    With the first size, some arrays are cached in memory; with the others, all are on the disk.
    """
    wanted = in_memory(cells, n_segments, **options)
    for tile_size in tile_sizes:
        cache = 1 << 20 if tile_size == tile_sizes[0] else 0
        found = sf.segment_tiled(
            cells, n_segments, tile_size=tile_size, scratch=tmp_path, cache=cache, **options
        )
        compare(found, wanted)
    assert not list(tmp_path.glob(".superfacets*"))
    return wanted


def check_number_of_tiles(cells, n_segments, tmp_path, n_tiles, tile_size=4096, **options):
    """Compare the result of `n_tiles` tiles, all on the disk, with the result in memory."""
    passes = set()
    found = sf.segment_tiled(
        cells, n_segments, tile_size=tile_size, scratch=tmp_path, cache=0,
        on_tile=lambda _, n: passes.add(n), **options,
    )  # fmt: skip
    assert n_tiles in passes
    compare(found, in_memory(cells, n_segments, **options))


@contextlib.contextmanager
def largest_file(n_bytes):
    """Refuse to write more than `n_bytes` to any file, much like a full disk."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def compare(found, wanted):
    """Compare two results."""
    assert np.array_equal(found.labels, wanted.labels)
    assert np.array_equal(found.centers, wanted.centers)
    assert found.params == wanted.params
    assert found.n_unreached == wanted.n_unreached
    assert [(level.n_cells, level.n_iter, level.stop_reason) for level in found.levels] == [
        (level.n_cells, level.n_iter, level.stop_reason) for level in wanted.levels
    ]
    assert found.sliver_share == pytest.approx(wanted.sliver_share, rel=1e-12, abs=1e-15)
