"""All models of the Princeton benchmark that are there."""

import os

import numpy as np
import pytest
import shapes
from models import read_off

from superfacets import build_face_graph, segment


def test_every_model_falls_into_exactly_150_connected_regions(benchmark_paths):
    assert len(benchmark_paths) == 95 or "SUPERFACETS_DATA" in os.environ
    for path in benchmark_paths:
        mesh = read_off(path)
        result = segment(mesh, 150)
        assert result.n_segments == 150, path.name
        assert np.array_equal(np.unique(result.labels), np.arange(150)), path.name
        assert shapes.count_pieces(build_face_graph(mesh), result.labels) == 150, path.name


@pytest.mark.parametrize("name", ["1", "125", "257"])
def test_the_paper_s_mode_covers_every_face_with_about_150_regions(data_dir, name):
    from superfacets import PAPER

    mesh = read_off(data_dir / "psb" / "off" / f"{name}.off")
    result = segment(mesh, 150, **PAPER)
    assert 150 <= result.n_segments <= 166
    assert result.labels.min() == 0
