"""Welding of vertices, exactly or with a tolerance."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets.mesh.weld import lowest_vertices


def test_vertices_within_the_tolerance_of_each_other_are_one():
    rng = np.random.default_rng(1)
    centers = rng.integers(0, 6, (40, 3)).astype(float)
    points = centers[rng.integers(0, 40, 500)] + rng.uniform(-0.05, 0.05, (500, 3))
    lowest = lowest_vertices(points, 0.1, 1)
    near = (np.abs(points[:, None] - points[None]) <= 0.1).all(axis=2)
    assert (lowest[:, None] == lowest[None])[near].all()
    assert (np.abs(points - points[lowest]) <= 0.2).all()
    assert (lowest <= np.arange(500)).all()
    assert np.array_equal(lowest[lowest], lowest)


@pytest.mark.parametrize("scale", [1.0, 1e6])
def test_faces_across_cracks_are_neighbors(scale, tmp_path):
    rng = np.random.default_rng(2)
    whole = shapes.bumpy_sheet(12)
    corners = whole.vertices[whole.faces].reshape(-1, 3) * scale
    cracked = corners * (1 + rng.uniform(-1e-9, 1e-9, corners.shape))
    soup = sf.Mesh(cracked, np.arange(len(corners)).reshape(-1, 3))
    with pytest.warns(sf.IslandWarning, match=r"almost coincide, prepare\(mesh, weld="):
        assert sf.segment(soup, 8).n_segments > 100
    assert sf.segment(sf.prepare(soup, weld=1e-6 * scale), 8).n_segments == 8
    graphs = (sf.build_face_graph(soup, weld=1e-6 * scale), sf.build_face_graph(whole))
    assert np.array_equal(*(graph.neighbors for graph in graphs))
    sf.write_mesh(tmp_path / "soup.ply", soup)
    sf.batch(tmp_path, tmp_path, formats=["npz"], n_segments=8, weld=1e-6 * scale)
    with np.load(tmp_path / "soup.superfacets.npz") as graph:
        regions = sf.region_graph(soup, graph["vertex_super_index"], weld=1e-6 * scale)
        assert np.array_equal(graph["x"], regions.to_pyg()["x"])
