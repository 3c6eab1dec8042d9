"""Labels do not depend on properties of the input that should not matter."""

import loops
import numpy as np
import pytest
import shapes
from models import read_off
from shapes import same_regions

from superfacets import (
    Mesh,
    MeshError,
    PointCloud,
    PolygonMesh,
    TetMesh,
    build_face_graph,
    read_mesh,
    sample_mesh,
    segment,
)
from superfacets.graph.surface import Surface
from superfacets.paper import superfacet_weights

MODES = [{}, {"paper": True}, {"init": "flood"}, {"init": "grid"}, {"weights": "creases"}]


REAL = [pytest.param(name, marks=pytest.mark.real_meshes) for name in ("bunny", "model")]


@pytest.fixture(scope="module", params=["sheet", "sample", *REAL])
def mesh(request):
    """Return a mesh without ties: two are made here, two are scanned.

    They have no orphans at k = 90, because indices decide which orphan becomes a center.
    """
    if request.param == "sheet":
        return shapes.bumpy_sheet(40)
    if request.param == "sample":
        return sample_mesh(8000)
    data_dir = request.getfixturevalue("data_dir")
    if request.param == "model":
        return read_off(data_dir / "psb" / "off" / "257.off")
    return read_mesh(data_dir / "meshes" / "bunny.ply")


def rotation(seed):
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


@pytest.mark.parametrize("options", MODES)
def test_labels_are_the_same_for_any_number_of_threads(mesh, options):
    one, two, eight = (loops.segment(mesh, 90, n_threads=n, **options) for n in (1, 2, 8))
    for other in (two, eight):
        assert np.array_equal(one.labels, other.labels)
        assert np.array_equal(one.centers, other.centers)
        assert one.n_iter == other.n_iter


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20, 1e-6, 1e6])
@pytest.mark.parametrize("options", MODES)
def test_labels_do_not_depend_on_the_unit_of_length(mesh, options, scale):
    scaled = Mesh(mesh.vertices * scale, mesh.faces)
    result = loops.segment(scaled, 90, **options)
    assert np.array_equal(result.labels, loops.segment(mesh, 90, **options).labels)


ENDS_OF_THE_RANGE = [2.0**-47, 1e-14, 1e14, 2.0**47]  # for shapes up to 4 wide


def scaled_cells(kind, scale):
    if kind == "tets":
        block = shapes.block(5)
        noise = np.random.default_rng(3).normal(0, 0.05, block.vertices.shape)
        return TetMesh((block.vertices + noise) / 5 * scale, block.tets)
    bear = sample_mesh(3000)
    if kind == "points":
        return PointCloud(bear.vertices * scale)
    if kind == "thin":
        return Mesh(bear.vertices * [1, 1, 1e-3] * scale, bear.faces)
    if kind == "polygons":
        return PolygonMesh.of_faces(bear.vertices * scale, bear.faces)
    return Mesh(bear.vertices * scale, bear.faces)


@pytest.mark.parametrize("scale", ENDS_OF_THE_RANGE)
@pytest.mark.parametrize("options", [{}, {"weights": "creases"}, {"features": True}], ids=str)
@pytest.mark.parametrize("kind", ["faces", "thin", "polygons", "tets", "points"])
def test_labels_are_the_same_at_both_ends_of_the_range_of_sizes(kind, options, scale):
    cells, scaled = scaled_cells(kind, 1.0), scaled_cells(kind, scale)
    if "features" in options:
        features = np.random.default_rng(4).random((len(segment(cells, 1).labels), 2))
        options = {"features": features}
    expected = loops.segment(cells, 20, **options).labels
    assert np.array_equal(loops.segment(scaled, 20, **options).labels, expected)


@pytest.mark.parametrize("kind", ["faces", "polygons", "tets", "points"])
@pytest.mark.parametrize("scale", [1e-16, 1e16, 1e-40, 1e40])
def test_sizes_beyond_the_range_are_refused(kind, scale):
    with pytest.raises(
        MeshError, match=r"box must be 1e-15 to 1e\+15, got .*: rescale the (mesh|cloud)"
    ):
        scaled_cells(kind, scale)


def test_weights_keep_every_bit_under_scaling_by_powers_of_two(mesh):
    scaled = Mesh(mesh.vertices * 2.0**-20, mesh.faces)
    assert np.array_equal(
        superfacet_weights(scaled, build_face_graph(scaled)),
        superfacet_weights(mesh, build_face_graph(mesh)),
    )


def test_weights_do_not_change_under_rigid_motion(mesh):
    """Weights times the diagonal, which rotation changes, are equal up to rounding."""
    moved = Mesh(mesh.vertices @ rotation(3).T + [3, -2, 1], mesh.faces)
    graph, moved_graph = build_face_graph(mesh), build_face_graph(moved)
    weights = superfacet_weights(mesh, graph) * graph.diagonal
    moved_weights = superfacet_weights(moved, moved_graph) * moved_graph.diagonal
    # Where a fold is flat up to rounding, rounding decides between concave and convex.
    assert np.abs(weights - moved_weights).max() <= 1e-6 * weights.max()


def test_shifting_by_whole_steps_changes_nothing():
    """Coordinates that stay exact after a shift give the same labels."""
    mesh = shapes.bumpy_sheet(30)
    exact = np.round(mesh.vertices * 2**20) / 2**20
    labels = segment((exact, mesh.faces), 40).labels
    assert np.array_equal(segment((exact + [8, -4, 2], mesh.faces), 40).labels, labels)


@pytest.mark.parametrize("options", MODES)
def test_labels_do_not_depend_on_the_order_of_vertices(mesh, options):
    order = np.random.default_rng(4).permutation(mesh.n_vertices)
    permuted = Mesh(mesh.vertices[order], np.argsort(order)[mesh.faces])
    assert np.array_equal(
        loops.segment(permuted, 90, **options).labels, loops.segment(mesh, 90, **options).labels
    )


@pytest.mark.parametrize("options", MODES)
def test_regions_do_not_depend_on_the_order_of_faces(mesh, options):
    order = np.random.default_rng(5).permutation(mesh.n_faces)
    permuted = loops.segment(Mesh(mesh.vertices, mesh.faces[order]), 90, **options).labels
    assert same_regions(permuted, loops.segment(mesh, 90, **options).labels[order])


def test_soup_gives_the_labels_of_the_mesh_it_came_from(mesh):
    assert np.array_equal(segment(shapes.soup(mesh), 90).labels, segment(mesh, 90).labels)


def test_turning_a_closed_mesh_inside_out_keeps_its_regions():
    mesh = sample_mesh(8000)
    inside_out = Mesh(mesh.vertices, mesh.faces[:, [0, 2, 1]])
    one, other = (segment(m, 90, smooth=False).labels for m in (inside_out, mesh))
    assert same_regions(one, other)


def with_flipped_faces(mesh, seed):
    faces = mesh.faces.copy()
    turned = np.random.default_rng(seed).uniform(size=len(faces)) < 0.5
    faces[turned] = faces[turned, ::-1]
    return Mesh(mesh.vertices, faces)


def test_weights_of_inconsistent_meshes_do_not_depend_on_the_order_of_faces():
    mesh = with_flipped_faces(shapes.bumpy_sheet(30), seed=1)
    order = np.random.default_rng(5).permutation(mesh.n_faces)
    weights = superfacet_weights(mesh, build_face_graph(mesh))
    permuted = Mesh(mesh.vertices, mesh.faces[order])
    assert np.array_equal(
        np.sort(superfacet_weights(permuted, build_face_graph(permuted))), np.sort(weights)
    )


def test_whether_an_inconsistent_mesh_is_inside_out_does_not_turn_with_it():
    mesh = with_flipped_faces(sample_mesh(5000), seed=2)
    verdicts = {
        Surface.of_faces(turned, build_face_graph(turned), 1).handle.is_inside_out
        for turned in [Mesh(mesh.vertices @ rotation(seed).T, mesh.faces) for seed in range(6)]
    }
    assert verdicts == {Surface.of_faces(mesh, build_face_graph(mesh), 1).handle.is_inside_out}
