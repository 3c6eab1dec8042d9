"""`cad_faces` gives one region per flat side and per curved face, whatever mesh a part has."""

import math

import numpy as np
import pytest
import shapes

import superfacets as sf


def normals_of(part):
    normals = np.cross(*np.diff(part.vertices[part.faces], axis=1).transpose(1, 0, 2))
    return normals / np.linalg.norm(normals, axis=1)[:, np.newaxis]


def same_regions(one, other):
    pairs = {*zip(one.tolist(), other.tolist(), strict=True)}
    return len(pairs) == one.max() + 1 == other.max() + 1


@pytest.mark.parametrize("n_arc", [4, 8, 40])
def test_flat_sides_are_separated_from_fillets(n_arc):
    part = shapes.rounded_slab(n_arc)
    labels = sf.cad_faces(part)
    is_flat = (np.abs(normals_of(part)) > 1e-9).sum(axis=1) == 1
    assert (labels.max(), labels.dtype) == (9, np.int32)
    assert len(np.unique(labels[is_flat])) == 6
    assert np.isin(labels[~is_flat], labels[is_flat]).sum() == 0


@pytest.mark.parametrize("n_around", [24, 48, 200])
def test_a_boss_is_separated_from_the_fillet_at_its_foot(n_around):
    part = shapes.filleted_boss(n_around)
    labels, upward = sf.cad_faces(part), np.abs(normals_of(part)[:, 2])
    assert labels.max() == 6
    for is_kind in (upward > 1 - 1e-9, upward < 1e-9):  # planes, cylinders
        assert len(np.unique(labels[is_kind])) == 3
        assert np.isin(labels[~is_kind], labels[is_kind]).sum() == 0


def turned(part):
    """Turn a part about an axis that is parallel to none of its edges, and move it."""
    axes, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    return sf.Mesh(part.vertices @ (axes * np.linalg.det(axes)).T + [30, -20, 10], part.faces)


def as_written(part):
    """Return the part as an STL file stores it: in float32, with three vertices per face."""
    soup = shapes.soup(turned(part))
    return sf.Mesh(soup.vertices.astype(np.float32).astype(float), soup.faces)


CHANGES = {
    "turned": turned, "float32": as_written,
    "meters": lambda part: sf.Mesh(part.vertices * 1e-3, part.faces),
    "inside out": lambda part: sf.Mesh(part.vertices, part.faces[:, ::-1]),
    "rounded": lambda part: sf.Mesh(part.vertices.round(5), part.faces),
    "decimals": lambda part: sf.Mesh(turned(part).vertices.round(3), part.faces),
    "far away": lambda part: sf.Mesh(np.float32(turned(part).vertices + 5000), part.faces),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("part", [shapes.filleted_boss(48), shapes.rounded_slab(8)])
def test_orientation_unit_and_rounding_do_not_matter(change, part):
    assert same_regions(sf.cad_faces(CHANGES[change](part)), sf.cad_faces(part))


def test_subdivided_triangles_and_polygons_have_the_same_regions():
    part = shapes.rounded_slab(8)
    fine = sf.subdivide(part, 0.5)
    assert same_regions(sf.cad_faces(fine.mesh), sf.cad_faces(part)[fine.sources])
    sides = part.faces[-2 * 36 :].reshape(2, 36, 3)
    quads = np.stack([*sides[0].T, sides[1, :, 2]], axis=1)
    corners = [*part.faces[: -2 * 36].tolist(), *quads.tolist()]
    offsets = np.cumsum([0, *map(len, corners)])
    assert sf.cad_faces(sf.PolygonMesh(part.vertices, offsets, np.concatenate(corners))).max() == 9


def test_irregular_triangles_have_one_region_per_face():
    """A quarter of a cylinder between two flat sides, as a mesher triangulates them."""
    x, y = np.random.default_rng(0).random((2, 40, 25))
    x = np.arange(40)[:, np.newaxis] + 0.5 * (x - 0.5)
    y = np.arange(25) + 0.5 * (y - 0.5)
    x[[0, 14, 26, 39]] = np.array([0, 14, 26, 39])[:, np.newaxis]
    turns = np.clip(x - 14, 0, 12) / 12 * math.pi / 2
    radius = 24 / math.pi
    along = np.minimum(x, 14) + radius * np.sin(turns)
    heights = radius * (np.cos(turns) - 1) - np.maximum(x - 26, 0)
    at = np.arange(1000).reshape(40, 25)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    sheet = sf.Mesh(np.stack([along, y, heights], axis=-1).reshape(-1, 3), faces)
    middles = x.ravel()[faces].mean(axis=1)
    assert same_regions(sf.cad_faces(sheet), (middles > 14).astype(int) + (middles > 26))


@pytest.mark.parametrize("shift", [0.0, 1e-9])
def test_a_sliver_on_a_sharp_edge_does_not_join_both_sides(shift):
    vertices = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, -2], [2, 0, -2], [1, shift, 0]]
    faces = [[0, 1, 2], [0, 2, 3], [0, 6, 1], [4, 6, 0], [4, 5, 6], [5, 1, 6]]
    assert sf.cad_faces(sf.Mesh(vertices, faces))[[0, 1, 3, 4, 5]].tolist() == [0, 0, 1, 1, 1]


def test_faces_without_neighbors_and_thin_sides_are_regions():
    assert sf.cad_faces(sf.Mesh(np.eye(3), [[0, 1, 2]])).tolist() == [0]
    assert sf.cad_faces(shapes.fins()).tolist() == [0, 1, 2]  # three faces share an edge
    plate = sf.Mesh(shapes.cube().vertices * [300, 300, 0.1], shapes.cube().faces)
    assert sf.cad_faces(plate).max() == 5  # few decimals need not be rounded
    cube = shapes.soup(shapes.cube())
    torn = sf.Mesh(cube.vertices + np.linspace(0, 1e-4, cube.n_vertices)[:, None], cube.faces)
    with pytest.warns(sf.IslandWarning, match="12 of 12 faces have no neighbor"):
        assert sf.cad_faces(torn).max() == 11
    assert sf.cad_faces(torn, weld=1e-3).max() == 5


@pytest.mark.parametrize("angle", [0, 181, np.nan])
def test_wrong_angles_are_refused(angle):
    with pytest.raises(ValueError, match="angle must be"):
        sf.cad_faces(shapes.cube(), angle)


def test_remeshed_parts_have_about_one_region_per_face(data_dir):
    ratios, errors = [], []
    for path in sorted(data_dir.glob("truth/cad_*.npz")):
        with np.load(path) as file:
            part, truth = sf.Mesh(file["vertices"], file["faces"]), file["truth"].ravel()
        labels = sf.cad_faces(part)
        ratios.append((labels.max() + 1) / len(np.unique(truth)))
        errors.append(sf.metrics.undersegmentation_error(part, labels, truth))
    assert 0.9 < np.median(ratios) < 1.1
    assert ratios.count(1.0) >= 6
    assert np.mean(errors) < 0.3
