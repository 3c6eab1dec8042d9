"""Detection of faces so long and thin that regions become stripes, and the warning."""

import math
import warnings

import numpy as np
import pytest
import shapes
from models import read_off

import superfacets as sf
from superfacets.graph.face_graph import FaceArcs
from superfacets.graph.size import sliver_share
from superfacets.metrics import compactness


def share_of(mesh, radius):
    faces, longest = FaceArcs.of(mesh, True, 2).measured(mesh, 2)
    return sliver_share(mesh, faces.measures, longest, radius, 2)


def test_the_share_counts_faces_longer_than_two_radii_and_thinner_than_half_of_one():
    """The mesh has right triangles with legs 1 and 1 (area 1/2), 6 and 1 (3), and 6 and 4 (12)."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [6, 0, 1], [6, 0, 0], [0, 4, 2], [6, 0, 2],
               [0, 1, 1], [0, 0, 1], [0, 0, 2]]  # fmt: skip
    mesh = sf.Mesh(corners, [[0, 1, 2], [8, 3, 7], [9, 6, 5]])
    assert share_of(mesh, 2.0) == 3 / 15.5
    assert share_of(mesh, 3.0) == 3 / 15.5  # the hypotenuse is 6.08
    assert share_of(mesh, 3.1) == 0  # no longer than 2 r
    assert share_of(mesh, 1.97) == 0  # 0.986 high
    assert share_of(mesh, 0.4) == 0
    assert share_of(mesh, 0.0) == 0


def test_a_surface_without_area_has_no_slivers():
    assert share_of(sf.Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]), 0.1) == 0


def test_the_share_does_not_depend_on_the_number_of_threads():
    mesh = shapes.bumpy_sheet(120)
    squeezed = sf.Mesh(mesh.vertices * [1, 0.02, 0.02], mesh.faces)
    faces, longest = FaceArcs.of(squeezed, True, 2).measured(squeezed, 2)
    shares = {sliver_share(squeezed, faces.measures, longest, 0.004, n) for n in (1, 2, 3, 8)}
    assert len(shares) == 1
    assert 0 < shares.pop() < 1


def test_faces_outside_the_mask_do_not_count():
    sheet = shapes.bumpy_sheet(20)
    far = len(sheet.vertices) + np.arange(3)
    corners = np.concatenate([sheet.vertices, [[5, 0, 0], [45, 0, 0], [45, 0.05, 0]]])
    mesh = sf.Mesh(corners, np.concatenate([sheet.faces, [far]]))
    with pytest.warns(sf.SliverWarning):  # smoothing would shrink the long face
        assert sf.segment(mesh, 20, islands="nearest", denoise=9).sliver_share > 0.4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        is_near = np.arange(mesh.n_faces) < sheet.n_faces
        kept = sf.segment(mesh, 20, mask=is_near, denoise=9)
    assert kept.sliver_share == 0


def test_a_fan_over_a_flat_face_is_warned_of_once_with_what_to_do():
    block = shapes.drilled_block(256)
    with pytest.warns(sf.SliverWarning) as caught:
        result = sf.segment(block, 100)
    assert len(caught) == 1
    message = str(caught[0].message)
    assert "\n" not in message
    assert caught[0].filename == __file__
    max_edge = result.params["radius"] / 4
    assert message == (
        "37% of the area is in faces that are long and thin compared with the regions, so regions"
        " may be stripes: subdivide first,"
        f" mesh = superfacets.subdivide(mesh, max_edge={max_edge:.3g}).mesh"
    )
    assert math.isclose(result.sliver_share, 0.375, abs_tol=0.01)


def test_after_what_the_warning_says_regions_are_rounder_and_there_is_no_warning():
    block = shapes.drilled_block(256)
    with pytest.warns(sf.SliverWarning):
        striped = sf.segment(block, 100)
    fine = sf.subdivide(block, striped.params["radius"] / 4)
    result = sf.segment(fine.mesh, 100)
    assert result.sliver_share == 0
    assert compactness(fine.mesh, result.labels) < 0.71 * compactness(block, striped.labels)


def test_labels_are_the_same_with_the_warning_off():
    block = shapes.drilled_block(64)
    with pytest.warns(sf.SliverWarning):
        one = sf.segment(block, 100)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.SliverWarning)
        assert np.array_equal(sf.segment(block, 100).labels, one.labels)


def test_the_warning_comes_before_the_work():
    told = []
    with warnings.catch_warnings():
        warnings.simplefilter("error", sf.SliverWarning)
        with pytest.raises(sf.SliverWarning):
            sf.segment(shapes.drilled_block(64), 100, callback=lambda *call: told.append(call))
    assert not any(n_iter for _, n_iter, _ in told)


def test_large_faces_are_not_slivers():
    """Each face of the cube is a region, which is not a stripe."""
    assert sf.segment(shapes.cube(), 12).sliver_share == 0


def test_cells_of_a_graph_have_no_share():
    mesh = shapes.bumpy_sheet(6)
    faces = sf.build_face_graph(mesh)
    graph = faces.with_weights(sf.crease_weights(mesh, faces, 0.1))
    assert isinstance(graph, sf.CellGraph)
    assert sf.segment_graph(graph, 5).sliver_share is None


def test_few_slivers_are_no_matter():
    assert sf.SliverWarning.text(0.1, "do") is None
    assert sf.SliverWarning.text(0.101, "do").endswith("may be stripes: do")


def test_nothing_is_said_of_the_sample_mesh():
    for mesh, k in ((sf.sample_mesh(), 150), (sf.sample_mesh(5_000), 150)):
        assert sf.segment(mesh, k).sliver_share < 0.001


def test_two_models_of_the_benchmark_that_gain_from_subdivision_are_named(benchmark_paths):
    """Subdivision improves their compactness with 150 regions: 8.9 to 5.6, and 8.4 to 5.1."""
    assert len(benchmark_paths) >= 95
    named = set()
    for path in benchmark_paths:
        mesh = read_off(path)
        radius = math.sqrt(sf.build_face_graph(mesh).measures.sum() / math.pi / 150)
        if sf.SliverWarning.text(share_of(mesh, radius), ""):
            named.add(path.stem)
    assert named == {"349", "353"}


@pytest.mark.parametrize(
    "name", ["bunny.ply", "hand.ply", "horse.ply", "cow.obj", "spot.obj", "fandisk.obj"]
)
def test_nothing_is_said_of_scans_and_even_meshes(data_dir, name):
    assert sf.segment(sf.read_mesh(data_dir / "meshes" / name), 150).sliver_share < 0.05
