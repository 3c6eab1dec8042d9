"""Smooth borders that cut faces: borders that must not change, and properties that must hold."""

import numpy as np
import pytest
import reference
import shapes

import superfacets as sf


def areas(mesh):
    return reference.measure_faces(mesh)[1]


def areas_of_regions(mesh, labels):
    inside = labels >= 0
    return np.bincount(labels[inside], areas(mesh)[inside])


def border_length(mesh, labels):
    lines = sf.border_lines(mesh, labels)
    return lines.lengths[lines.regions[:, 1] >= 0].sum()


def sheet(n=24, seed=0):
    """Return a flat square of side n: right triangles with legs of 1, along random diagonals."""
    squares = shapes.squares(n)
    is_flipped = np.random.default_rng(seed).random((squares.n_faces, 1)) < 0.5
    corners = squares.indices.reshape(-1, 4)
    halves = np.where(is_flipped, corners[:, [0, 1, 3, 1, 2, 3]], corners[:, [0, 1, 2, 0, 2, 3]])
    return sf.Mesh(squares.vertices, halves.reshape(-1, 3))


def labels_where(mesh, *conditions):
    """Return the index of the first condition that holds at the centroid of each face."""
    x, y, z = mesh.vertices[mesh.faces].mean(axis=1).T
    return np.select([condition(x, y, z) for condition in conditions], range(len(conditions)))


def sphere(max_edge=0.12):
    """Return a sphere of radius 1."""
    box = sf.subdivide(sf.Mesh(shapes.cube().vertices * 2 - 1, shapes.cube().faces), max_edge).mesh
    return sf.Mesh(box.vertices / np.linalg.norm(box.vertices, axis=1, keepdims=True), box.faces)


def crossing_half(mesh, slope=0.37):
    """Label the two sides of an inclined line through the middle of a 24 x 24 sheet."""
    return labels_where(mesh, lambda x, y, z: y < 12 + slope * (x - 12), lambda x, y, z: y > -1)


def assert_sound(old, labels, cut):
    """Check the documented properties of a result of `cut_borders`."""
    n_old = old.n_vertices
    assert cut.n_old_vertices == n_old
    assert np.array_equal(cut.mesh.vertices[:n_old], old.vertices)
    assert np.all(np.diff(cut.sources) >= 0)
    assert np.bincount(cut.sources).max() <= 6
    of_sources = np.bincount(cut.sources, areas(cut.mesh), minlength=old.n_faces)
    assert of_sources == pytest.approx(areas(old), rel=1e-9, abs=1e-12)
    before, after = areas_of_regions(old, labels), areas_of_regions(cut.mesh, cut.labels)
    assert np.abs(after - before).sum() <= 0.01 * before.sum()
    assert np.all(np.abs(after - before) <= 0.15 * before)
    n_before = shapes.count_pieces(sf.build_face_graph(old), labels)
    n_after = shapes.count_pieces(sf.build_face_graph(cut.mesh), cut.labels)
    assert (labels < 0).any() or n_after <= n_before
    kept = np.flatnonzero(np.append(cut.is_kept, False)[labels])
    assert np.array_equal(cut.labels[np.isin(cut.sources, kept)], labels[kept])


def test_a_zigzag_through_a_plane_becomes_nearly_straight():
    mesh = sheet()
    labels = crossing_half(mesh)
    cut = sf.cut_borders(mesh, labels)
    assert_sound(mesh, labels, cut)
    straight = 24 * np.hypot(1, 0.37)
    assert border_length(mesh, labels) > 1.1 * straight
    assert border_length(cut.mesh, cut.labels) < 1.01 * straight


def test_faces_away_from_borders_stay_as_they_are():
    mesh = sheet()
    labels = crossing_half(mesh)
    cut = sf.cut_borders(mesh, labels)
    is_whole = np.bincount(cut.sources)[cut.sources] == 1
    assert np.array_equal(cut.mesh.faces[is_whole], mesh.faces[cut.sources[is_whole]])
    assert is_whole.sum() > 0.9 * mesh.n_faces


@pytest.mark.parametrize("max_edge", [2, 0.3])
def test_the_edges_of_a_cube_stay(max_edge):
    fine = sf.subdivide(shapes.cube(), max_edge)
    labels = fine.sources // 2
    cut = sf.cut_borders(fine.mesh, labels)
    assert np.array_equal(cut.mesh.faces, fine.mesh.faces)
    assert np.array_equal(cut.mesh.vertices, fine.mesh.vertices)
    assert np.array_equal(cut.labels, labels)


def test_a_straight_crease_stays_and_borders_beside_it_move():
    """On a roof, the ridge stays, and a zigzag border that ends at the ridge becomes straight."""
    flat = sheet()
    bent = flat.vertices * [1, 1, 0] + [0, 0, 1] * -np.abs(flat.vertices[:, :1] - 12) * np.tan(
        np.pi / 8
    )
    mesh = sf.Mesh(bent, flat.faces)
    labels = labels_where(
        flat, lambda x, y, z: x < 12, lambda x, y, z: y < 0.37 * x + 4, lambda x, y, z: x > 0
    )
    cut = sf.cut_borders(mesh, labels)
    is_left = cut.labels == 0
    assert np.array_equal(np.unique(cut.sources[is_left]), np.flatnonzero(labels == 0))
    assert is_left.sum() == (labels == 0).sum()
    assert border_length(cut.mesh, cut.labels) < border_length(mesh, labels) - 0.5


def test_a_closed_surface_stays_closed():
    mesh = sphere()
    labels = sf.segment(mesh, 20).labels
    cut = sf.cut_borders(mesh, labels)
    assert_sound(mesh, labels, cut)
    counts = sf.build_face_graph(cut.mesh).edge_counts
    assert (counts.boundary, counts.non_manifold, counts.inconsistent) == (0, 0, 0)
    assert cut.mesh.n_vertices - counts.edges + cut.mesh.n_faces == 2
    assert sf.metrics.compactness(cut.mesh, cut.labels) < 0.98 * sf.metrics.compactness(
        mesh, labels
    )


def test_three_regions_meet_in_a_point_at_equal_angles():
    mesh = sheet()
    labels = labels_where(
        mesh, lambda x, y, z: (y > 12) & (np.abs(x - 12) < np.sqrt(3) * (y - 12)),
        lambda x, y, z: x < 12, lambda x, y, z: x > 0,
    )  # fmt: skip
    cut = sf.cut_borders(mesh, labels)
    assert_sound(mesh, labels, cut)
    lines = sf.border_lines(cut.mesh, cut.labels)
    inner = [lines.line(i) for i in np.flatnonzero(lines.regions[:, 1] >= 0)]
    [junction] = set.intersection(*({line[0], line[-1]} for line in inner))
    middle = cut.mesh.vertices[junction]
    assert np.linalg.norm(middle - [12, 12, 0]) < 1
    inward = [line if line[0] == junction else line[::-1] for line in inner]
    ways = [cut.mesh.vertices[line[min(8, len(line) - 1)]] - middle for line in inward]
    ways = [way / np.linalg.norm(way) for way in ways]
    cosines = [ways[i] @ ways[i - 1] for i in range(3)]
    assert cosines == pytest.approx([-0.5] * 3, abs=0.25)


def test_borders_beside_faces_in_no_region_become_smooth():
    mesh = sheet()
    labels = crossing_half(mesh) - 1
    cut = sf.cut_borders(mesh, labels)
    assert_sound(mesh, labels, cut)
    assert set(cut.labels.tolist()) == {-1, 0}
    whole = np.where(cut.labels < 0, 1, 0)
    assert border_length(cut.mesh, whole) < 1.01 * 24 * np.hypot(1, 0.37)


def test_regions_too_small_for_a_smooth_border_keep_their_faces():
    mesh = sheet(4)
    labels = np.arange(mesh.n_faces)
    cut = sf.cut_borders(mesh, labels)
    assert cut.is_kept.sum() > 16
    assert np.array_equal(cut.mesh.faces, mesh.faces)
    assert np.array_equal(cut.labels, labels)


def test_a_single_region_is_not_cut():
    mesh = shapes.strip(5)
    cut = sf.cut_borders(mesh, np.zeros(5, np.int32))
    assert np.array_equal(cut.mesh.faces, mesh.faces)
    assert not cut.is_kept.any()


def odd_meshes():
    ball = sphere(0.3)
    yield "open", shapes.bumpy_sheet(12)
    yield "soup", shapes.soup(ball)
    yield "moebius", shapes.moebius(60)
    yield "fins", sf.subdivide(shapes.fins(4), 0.2).mesh
    yield "bowtie", sf.subdivide(shapes.bowtie(), 0.2).mesh
    yield "inside out", sf.Mesh(ball.vertices, ball.faces[:, ::-1])
    mixed = np.where((np.arange(ball.n_faces) % 3 == 0)[:, np.newaxis], ball.faces[:, ::-1], 0)
    yield (
        "inconsistent",
        sf.Mesh(ball.vertices, np.where(mixed.any(axis=1)[:, None], mixed, ball.faces)),
    )
    flat = np.concatenate([ball.faces, ball.faces[:9, [0, 0, 1]], ball.faces[:9, [2, 2, 2]]])
    yield "degenerate", sf.Mesh(ball.vertices, flat)
    yield "slivers", sf.subdivide(shapes.slivers(), 0.5).mesh
    yield "doubled", sf.Mesh(ball.vertices, np.concatenate([ball.faces, ball.faces]))
    soup = np.random.default_rng(1).random((90, 3))
    yield "random", sf.Mesh(soup, np.random.default_rng(2).integers(0, 90, (300, 3)))


ODD_MESHES = dict(odd_meshes())


@pytest.mark.parametrize("name", ODD_MESHES)
@pytest.mark.parametrize("seed", [0, 1])
def test_odd_meshes_are_cut_soundly(name, seed):
    mesh = ODD_MESHES[name]
    rng = np.random.default_rng(seed)
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    seeds = centers[rng.choice(mesh.n_faces, 6, replace=False)]
    nearest = np.linalg.norm(centers[:, None] - seeds, axis=2).argmin(axis=1)
    labels = np.unique(nearest, return_inverse=True)[1]
    cut = sf.cut_borders(mesh, labels)
    assert_sound(mesh, labels, cut)
    before, after = sf.build_face_graph(mesh).edge_counts, sf.build_face_graph(cut.mesh).edge_counts
    if name != "degenerate":
        assert (after.boundary == 0) == (before.boundary == 0)
        assert (after.non_manifold == 0) == (before.non_manifold == 0)


def test_a_seam_is_cut_at_the_same_positions_on_both_sides():
    ball = sphere(0.3)
    seamed = shapes.soup(ball)
    labels = sf.segment(ball, 8).labels
    one, other = sf.cut_borders(ball, labels), sf.cut_borders(seamed, labels)
    assert sf.build_face_graph(other.mesh).edge_counts.boundary == 0
    assert np.array_equal(one.labels, other.labels)
    assert other.mesh.vertices[other.mesh.faces] == pytest.approx(
        one.mesh.vertices[one.mesh.faces], abs=1e-5
    )


@pytest.mark.parametrize("flatness", [1.0, 0.2, 0.02])
def test_no_angle_of_a_part_is_below_a_twentieth_of_the_smallest_of_its_face(flatness):
    mesh = sphere()
    labels = sf.segment(mesh, 40).labels
    flat = sf.Mesh(mesh.vertices * [1, 1, flatness], mesh.faces)
    cut = sf.cut_borders(flat, labels)
    assert (
        np.min(shapes.smallest_angles(cut.mesh) / shapes.smallest_angles(flat)[cut.sources]) > 0.05
    )


@pytest.mark.parametrize("n_threads", [2, 3])
def test_any_number_of_threads_gives_the_same_mesh(n_threads):
    mesh = sf.sample_mesh()
    labels = sf.segment(mesh, 150).labels
    one = sf.cut_borders(mesh, labels, n_threads=1)
    many = sf.cut_borders(mesh, labels, n_threads=n_threads)
    assert np.array_equal(one.mesh.vertices, many.mesh.vertices)
    assert np.array_equal(one.mesh.faces, many.mesh.faces)
    assert np.array_equal(one.labels, many.labels)


def test_scale_and_place_do_not_matter():
    """Scaling by a power of two changes only the exponents of coordinates."""
    mesh = sphere(0.3)
    labels = sf.segment(mesh, 8).labels
    small = sf.cut_borders(sf.Mesh(mesh.vertices * 2.0**-40, mesh.faces), labels)
    whole = sf.cut_borders(mesh, labels)
    assert np.array_equal(small.mesh.faces, whole.mesh.faces)
    assert np.array_equal(small.mesh.vertices * 2.0**40, whole.mesh.vertices)


def test_the_order_of_faces_and_names_of_regions_hardly_matter():
    """Sums depend on the order of faces, so the last bits of positions differ."""
    mesh = sphere(0.3)
    labels = sf.segment(mesh, 8, weights="creases").labels
    order = np.random.default_rng(0).permutation(mesh.n_faces)
    turned = sf.cut_borders(sf.Mesh(mesh.vertices, mesh.faces[order]), 7 - labels[order])
    whole = sf.cut_borders(mesh, labels)
    assert turned.mesh.n_faces == whole.mesh.n_faces
    assert areas_of_regions(turned.mesh, 7 - turned.labels) == pytest.approx(
        areas_of_regions(whole.mesh, whole.labels), rel=5e-3
    )


def test_polygons_are_cut_into_triangles_first():
    quads = shapes.squares(8)
    labels = (np.arange(64) % 8 + np.arange(64) // 8 > 7).astype(int)
    cut = sf.cut_borders(quads, labels)
    assert cut.n_sources == 64
    assert np.bincount(cut.sources, areas(cut.mesh)) == pytest.approx(np.ones(64))
    assert border_length(cut.mesh, cut.labels) < 0.8 * border_length(quads, labels)


def test_the_result_says_its_sizes_and_is_read_only():
    mesh = sheet()
    cut = sf.cut_borders(mesh, crossing_half(mesh))
    assert isinstance(cut, sf.BorderCut)
    assert repr(cut) == f"BorderCut(1152 faces into {cut.mesh.n_faces})"
    with pytest.raises(ValueError, match="read-only"):
        cut.labels[0] = 1


def test_labels_that_do_not_fit_are_refused():
    mesh = shapes.strip(4)
    with pytest.raises(
        ValueError, match=r"labels must have one value per cell \(4\), got 3 values"
    ):
        sf.cut_borders(mesh, [0, 0, 1])
    with pytest.raises(
        ValueError, match="labels must contain at least one region, but all labels are -1"
    ):
        sf.cut_borders(mesh, [-1] * 4)
    with pytest.raises(TypeError):
        sf.cut_borders(mesh, [0.5] * 4)
    with pytest.raises(sf.MeshError):
        sf.cut_borders(([[0, 0, 0]], [[0, 0, 1]]), [0])
