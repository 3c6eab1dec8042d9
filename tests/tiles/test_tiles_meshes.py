"""Tiles of files that are read in pieces equal those cut from the mesh in memory, byte by byte."""

import numpy as np
import pytest
from cut_mesh import cut_mesh, run_serially
from shapes import bowtie, cube, fins, moebius, soup, together
from tiled_meshes import as_ply, random_polygons

import superfacets as sf
from superfacets import Mesh, MeshError, PolygonMesh
from superfacets._validate import MAX_CELLS
from superfacets.io.tables import take_rows
from superfacets.tiles import arrays, mesh_tiles
from superfacets.tiles.denoising import make_mesh_tiles
from superfacets.tiles.opening import open_pieces
from superfacets.workers.scratch import scratch_folder


def check(source, mesh, tmp_path, tile_cells=4096, *, welds=True, for_workers=False):
    """Make tiles of a source, and compare all files with those of the mesh in memory."""
    with scratch_folder(tmp_path) as made, scratch_folder(tmp_path) as cut:
        pieces = open_pieces(source, made, for_workers=for_workers)
        store, *_ = make_mesh_tiles(
            pieces, made, tile_cells, welds=welds, run=run_serially, n_threads=1
        )
        wanted = cut_mesh(mesh, cut, store.n_tiles, weld=welds)
        assert store.n_tiles == -(-mesh.n_faces // tile_cells)
        assert (store.starts, store.kind) == (wanted.starts, wanted.kind)
        assert store.total_measure == wanted.total_measure
        assert np.array_equal(store.bounds, wanted.bounds)
        names = {path.relative_to(cut.folder) for path in cut.folder.rglob("*.npy")}
        for name in names:
            assert (made.folder / name).read_bytes() == (cut.folder / name).read_bytes(), name
        left = {path.relative_to(made.folder) for path in made.folder.rglob("*.npy")} - names
        assert {path.name for path in left} <= {"cuts.npy"}


@pytest.fixture(scope="module")
def bear():
    return sf.sample_mesh(30_000)  # 19,568 faces


@pytest.mark.parametrize("tile_cells", [4096, 12_288, 1 << 20])
@pytest.mark.parametrize("welds", [True, False])
def test_tiles_of_a_file_are_those_of_the_mesh(bear, tmp_path, tile_cells, welds):
    check(as_ply(tmp_path, bear), bear, tmp_path, tile_cells, welds=welds)


def test_tiles_do_not_depend_on_the_order_of_faces_and_vertices(bear, tmp_path):
    generator = np.random.default_rng(0)
    order = generator.permutation(bear.n_vertices)
    faces = np.argsort(order)[bear.faces][generator.permutation(bear.n_faces)]
    shuffled = Mesh(bear.vertices[order], faces)
    check(as_ply(tmp_path, shuffled), shuffled, tmp_path)


@pytest.mark.parametrize("for_workers", [True, False])
def test_vertices_of_a_soup_are_welded_on_disk(bear, tmp_path, for_workers):
    for mesh in (soup(bear), Mesh(soup(bear).vertices * [1, -1, 0], soup(bear).faces)):
        check(mesh, mesh, tmp_path, for_workers=for_workers)
        check(mesh, mesh, tmp_path, welds=False, for_workers=for_workers)


def test_cells_on_one_step_of_the_curve_keep_the_order_of_the_input(bear, tmp_path):
    far = Mesh([[1e9, 0, 0], [1e9, 1, 0], [1e9, 0, 1]], [[0, 1, 2]])
    crowded = together([bear, far])
    check(crowded, crowded, tmp_path)


@pytest.mark.parametrize("shape", [cube, bowtie, fins, moebius])
def test_small_meshes_are_one_tile(shape, tmp_path):
    check(shape(), shape(), tmp_path)


def test_polygons_keep_their_corners(tmp_path):
    mesh = random_polygons(9_000)
    check(mesh, mesh, tmp_path)
    check(mesh, mesh, tmp_path, welds=False, for_workers=True)


def test_vertices_in_few_blocks_of_many_are_found(bear, tmp_path, monkeypatch):
    monkeypatch.setattr("superfacets.io.tables.BLOCK_BITS", 6)
    monkeypatch.setattr(arrays, "MAX_SPAN", 10)
    for most in (1_000, 100_000):

        def few(rows, wanted, _, most=most):
            return take_rows(rows, wanted, most)

        monkeypatch.setattr(mesh_tiles, "take_rows", few)
        check(as_ply(tmp_path, bear), bear, tmp_path)


def wrong(mesh, face, vertex):
    """Return the arrays of a mesh, with a wrong index."""
    faces = np.array(mesh.faces)
    faces[face, 1] = vertex
    return np.array(mesh.vertices), faces


@pytest.mark.parametrize("vertex", [-1, 9_786, MAX_CELLS])
def test_a_wrong_index_is_named_as_in_memory(bear, tmp_path, vertex):
    arrays = wrong(bear, 9_000, vertex)
    message = rf"faces\[9000\] refers to vertex {vertex} but the mesh has 9786 vertices"
    with pytest.raises(MeshError, match=message):
        Mesh(*arrays)
    with pytest.raises(MeshError, match=message):
        check(arrays, bear, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("welds", [True, False])
def test_a_wrong_coordinate_is_named_as_in_memory(bear, tmp_path, welds):
    vertices = np.array(bear.vertices)
    vertices[7_000, 1] = np.nan
    vertices[9_000, 1] = np.inf
    with pytest.raises(MeshError) as of_memory:
        Mesh(vertices, bear.faces)
    with pytest.raises(MeshError, match=r"vertices\[7000\] must be finite, got \[") as of_tiles:
        check((vertices, bear.faces), bear, tmp_path, welds=welds)
    assert str(of_tiles.value) == str(of_memory.value)


def test_a_mesh_without_extent_is_refused(tmp_path):
    with pytest.raises(MeshError, match="all faces lie at one point"):
        check((np.ones((3, 3)), np.array([[0, 1, 2]])), cube(), tmp_path)


def test_more_faces_than_can_be_numbered_are_refused(tmp_path):
    many = np.broadcast_to(np.int32([0, 1, 2]), (MAX_CELLS + 1, 3))
    with pytest.raises(MeshError, match=f"{MAX_CELLS + 1} faces; at most {MAX_CELLS} are"):
        check((cube().vertices, many), cube(), tmp_path)


def test_real_meshes_are_cut_alike(data_dir, tmp_path):
    for name in ["bunny.ply", "beast.obj", "igea_tristrips.ply"]:
        path = data_dir / "meshes" / name
        check(path, sf.read_mesh(path), tmp_path, 16_384)


def test_polygons_and_triangles_are_told_apart(tmp_path):
    mesh = PolygonMesh(cube().vertices, [0, 3, 7], [0, 2, 3, 4, 5, 7, 6])
    check(mesh, mesh, tmp_path)
