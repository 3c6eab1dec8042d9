"""Connected components and parts of a surface, which apps use."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets.kit import Prepared


def surface_of(mesh):
    return Prepared.of(mesh, weld=True, n_threads=1).surface(weld=True, n_threads=1)


def strip():
    vertices = [[x // 2, x % 2, 0] for x in range(8)]
    return sf.Mesh(vertices, [[f, f + 1, f + 2] for f in range(6)])


def test_components_are_numbered_by_their_lowest_cells():
    surface = surface_of(strip())
    assert surface.components([5, 5, -1, -1, 5, 5]).tolist() == [0, 0, 1, 1, 2, 2]
    with pytest.raises(ValueError, match=r"labels must have one value per cell \(6\), got 1 value"):
        surface.components([5])


def test_the_surface_of_prepared_cells_is_in_the_order_of_the_caller():
    mesh = shapes.bumpy_sheet(24)
    shuffled = sf.Mesh(mesh.vertices, np.random.default_rng(0).permutation(mesh.faces))
    expected = sf.build_face_graph(shuffled)
    assert np.array_equal(surface_of(shuffled).neighbors, expected.neighbors)


def test_a_region_graph_of_a_surface_is_that_of_its_mesh():
    labels = [0, 0, 1, 1, 2, 2]
    graph = sf.RegionGraph.of_surface(surface_of(strip()), labels)
    assert np.array_equal(graph.edge_index, sf.region_graph(strip(), labels).edge_index)
    with pytest.raises(ValueError, match="labels must be consecutive integers from 0, but no cell"):
        sf.RegionGraph.of_surface(surface_of(strip()), [0, 0, 2, 2, 2, 2])
