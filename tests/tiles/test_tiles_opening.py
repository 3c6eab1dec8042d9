"""All kinds of files, folders and arrays of meshes, read in pieces."""

import os

import numpy as np
import pytest
from shapes import cube, strip, together

import superfacets as sf
from superfacets import Mesh, MeshError, PointCloud, PolygonMesh
from superfacets.io.tables import ArrayRows, RecordRows
from superfacets.tiles import opening
from superfacets.tiles.opening import open_pieces
from superfacets.workers.scratch import scratch_folder


@pytest.fixture
def scratch(tmp_path):
    with scratch_folder(tmp_path / "scratch") as made:
        yield made


def mesh_of(pieces, step=7):
    """Return the mesh of pieces, read a few rows at a time."""
    n_vertices, n_faces = pieces.points.n_rows, pieces.n_cells
    vertices = [pieces.points.read(at, min(at + step, n_vertices))
                for at in range(0, n_vertices, step)]  # fmt: skip
    parts = [pieces.corners_of(at, min(at + step, n_faces)) for at in range(0, n_faces, step)]
    corners = np.concatenate([some for some, _ in parts])
    points = np.concatenate(vertices).astype(np.float64)
    if pieces.offsets is None:
        return Mesh(points, corners.reshape(-1, 3))
    sizes = np.concatenate([np.diff(offsets) for _, offsets in parts])
    return PolygonMesh(points, np.append(0, np.cumsum(sizes)), corners)


def check(source, scratch, mesh=None, *, for_workers=True):
    mesh = sf.read_mesh(source) if mesh is None else mesh
    found = mesh_of(open_pieces(source, scratch, for_workers=for_workers))
    assert type(found) is type(mesh)
    assert np.array_equal(found.vertices, mesh.vertices)
    if isinstance(mesh, PolygonMesh):
        assert np.array_equal(found.offsets, mesh.offsets)
        assert np.array_equal(found.indices, mesh.indices)
    else:
        assert np.array_equal(found.faces, mesh.faces)


@pytest.fixture
def bear():
    return sf.sample_mesh(3_000)


@pytest.mark.parametrize("name", ["a.ply", "a.obj", "a.off", "a.glb"])
def test_files_hold_what_they_hold_in_memory(bear, scratch, tmp_path, name):
    sf.write_mesh(tmp_path / name, bear)
    check(tmp_path / name, scratch)
    check(str(tmp_path / name), scratch)


def test_a_ply_of_triangles_is_read_where_it_is(bear, scratch, tmp_path):
    sf.write_mesh(tmp_path / "a.ply", bear)
    sf.write_mesh(tmp_path / "text.ply", bear, ascii=True)
    labels = np.arange(bear.n_faces)
    sf.write_mesh(tmp_path / "labels.ply", bear, labels=labels)  # with further properties
    for name in ("a.ply", "labels.ply"):
        pieces = open_pieces(tmp_path / name, scratch, for_workers=True)
        assert pieces.corners.path == tmp_path / name
        check(tmp_path / name, scratch)
    check(tmp_path / "text.ply", scratch)


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize(("kind", "dtype"), [("float", "f4"), ("double", "f8"), ("short", "i2")])
def test_numbers_of_a_ply_keep_their_type(scratch, tmp_path, order, kind, dtype):
    mark = "<" if order == "little" else ">"
    header = (
        f"ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty uchar red\n"
        f"property {kind} x\nproperty {kind} y\nproperty {kind} z\nelement face 2\n"
        "property list uchar uint vertex_index\nproperty short flag\nend_header\n"
    )
    vertices = np.zeros(4, [("red", "u1"), ("at", mark + dtype, (3,))])
    vertices["at"] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 5]]
    faces = np.zeros(2, [("n", "u1"), ("corners", mark + "u4", (3,)), ("flag", "i2")])
    faces["n"], faces["corners"] = 3, [[0, 1, 2], [0, 2, 3]]
    path = tmp_path / "a.ply"
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
    check(path, scratch)
    assert open_pieces(path, scratch, for_workers=True).points.read(0, 4).dtype == dtype


def test_polygons_come_from_ply_and_obj(scratch, tmp_path):
    mesh = PolygonMesh(cube().vertices, [0, 3, 7], [0, 2, 3, 4, 5, 7, 6])
    for name in ("a.ply", "a.obj", "a.off"):
        sf.write_mesh(tmp_path / name, mesh)
        check(tmp_path / name, scratch)


def test_an_obj_is_read_in_blocks_of_whole_lines(bear, scratch, tmp_path, monkeypatch):
    lines = ["# of nobody"]
    lines += ["v " + " ".join(map(repr, row)) for row in bear.vertices[:500].tolist()]
    lines += ["f 1/1/1 2/2 \\", "  3", "f -1 -2 -3 -4", "o more", "v 0 0 1", "f -1 1 2"]
    path = tmp_path / "a.obj"
    path.write_text("\n".join(lines))
    for size in (50, 80, 1_000):
        monkeypatch.setattr(opening, "BLOCK", size)
        check(path, scratch)
    lines[300] = "v 1 2"
    path.write_text("\n".join(lines))
    with pytest.raises(MeshError) as in_memory:
        sf.read_mesh(path)
    with pytest.raises(MeshError, match="line 301: a vertex needs 3 coordinates") as in_pieces:
        open_pieces(path, scratch, for_workers=True)
    assert str(in_pieces.value) == str(in_memory.value)


def test_a_folder_holds_the_meshes_in_it_by_name(scratch, tmp_path):
    folder = tmp_path / "city"
    folder.mkdir()
    parts = [cube(), strip(5), cube()]
    for name, part in zip(["a.ply", "b.obj", "c.off"], parts, strict=True):
        sf.write_mesh(folder / name, part)
    (folder / "readme.txt").write_text("of tiles")
    check(folder, scratch, together(parts))
    sf.write_mesh(folder / "d.obj", PolygonMesh(cube().vertices, [0, 4], [0, 1, 3, 2]))
    with pytest.raises(
        MeshError, match="all files in a folder must be triangle meshes, but one has other polygons"
    ):
        open_pieces(folder, scratch, for_workers=True)


@pytest.mark.parametrize("for_workers", [True, False])
def test_arrays_and_maps_of_files_are_read_as_they_are(bear, scratch, tmp_path, for_workers):
    np.save(tmp_path / "v.npy", bear.vertices.astype(np.float32))
    np.save(tmp_path / "f.npy", bear.faces.astype(np.uint32))
    maps = [np.load(tmp_path / name, mmap_mode="r") for name in ("v.npy", "f.npy")]
    rounded = Mesh(bear.vertices.astype(np.float32), bear.faces)
    for source, mesh in [(tuple(maps), rounded), (bear, bear), ((bear.vertices, bear.faces), bear)]:
        check(source, scratch, mesh, for_workers=for_workers)
        kind = RecordRows if for_workers else ArrayRows
        assert isinstance(open_pieces(source, scratch, for_workers=for_workers).points, kind)
    quads = (cube().vertices, [[0, 2, 3, 1], [4, 5, 7, 6]])
    check(quads, scratch, PolygonMesh(quads[0], [0, 4, 8], np.ravel(quads[1])))


OF_FACES = r"faces must be integers of shape \(F, n\), n >= 3, got "


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices must be numbers of shape \(V, 3\), got float64"),
        (np.zeros((3, 3)), [[0, 1]], OF_FACES + r"int64 of shape \(1, 2\)"),
        (np.zeros((3, 3)), [[0.5, 1, 2]], OF_FACES + r"float64 of shape \(1, 3\)"),
        (np.zeros((3, 3)), np.zeros((0, 3), int), "the mesh has no faces"),
    ],
)
def test_arrays_of_another_shape_are_refused(scratch, vertices, faces, message):
    with pytest.raises(MeshError, match=message):
        open_pieces((vertices, faces), scratch, for_workers=False)


def test_files_that_are_not_there_or_hold_nothing_are_named(scratch, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(FileNotFoundError, match=r"no\.ply: no such file"):
        open_pieces(tmp_path / "no.ply", scratch, for_workers=False)
    with pytest.raises(FileNotFoundError, match=r"empty: has no file that ends in \.glb, "):
        open_pieces(tmp_path / "empty", scratch, for_workers=False)
    for text, message in [("v 0 0 0\n", "a.obj: the mesh has no faces"), ("#", "not an OBJ file")]:
        (tmp_path / "a.obj").write_text(text)
        with pytest.raises(MeshError, match=message):
            open_pieces(tmp_path / "a.obj", scratch, for_workers=False)
    (tmp_path / "a.doc").write_text("0 0 0\n")
    with pytest.raises(MeshError, match=r"a\.doc: expected the ending"):
        open_pieces(tmp_path / "a.doc", scratch, for_workers=False)


def test_tetrahedra_are_refused(scratch, tmp_path):
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    sf.write_mesh(tmp_path / "a.vtu", sf.TetMesh(points, [[0, 1, 2, 3]]))
    with pytest.raises(MeshError, match=r"a\.vtu: only faces or points can be processed in tiles"):
        open_pieces(tmp_path / "a.vtu", scratch, for_workers=False)


def test_a_ply_that_is_cut_or_damaged_is_named(bear, scratch, tmp_path):
    path = tmp_path / "a.ply"
    sf.write_mesh(path, bear)
    content = path.read_bytes()
    path.write_bytes(content[:2_000])
    with pytest.raises(MeshError, match=r"a\.ply: .* declares .* of element 'vertex'"):
        open_pieces(path, scratch, for_workers=False)
    path.write_bytes(content[:-20])
    with pytest.raises(MeshError, match=r"a\.ply: .* the file ends"):
        open_pieces(path, scratch, for_workers=False)
    damaged = bytearray(content)
    damaged[-13 * 5] = 2  # the number of corners of the fifth face from the end
    path.write_bytes(damaged)
    pieces = open_pieces(path, scratch, for_workers=False)
    with pytest.raises(MeshError, match=rf"faces\[{bear.n_faces - 5}\] has 2 corners, expected 3"):
        pieces.corners_of(0, bear.n_faces)


@pytest.fixture
def cloud():
    """Return points with normals, all exact in float32."""
    points = np.random.default_rng(0).random((500, 3)).astype(np.float32)
    return PointCloud(points, (points - 0.5).astype(np.float32))


def check_cloud(source, scratch, wanted, *, for_workers=True, step=7):
    pieces = open_pieces(source, scratch, for_workers=for_workers)
    assert pieces.n_cells == wanted.n_points

    def read(rows):
        steps = range(0, rows.n_rows, step)
        return np.concatenate([rows.read(at, min(at + step, rows.n_rows)) for at in steps])

    assert np.array_equal(read(pieces.points), wanted.points)
    assert read(pieces.points).dtype == np.float64
    assert (pieces.normals is None) == (wanted.normals is None)
    if wanted.normals is not None:
        assert np.array_equal(read(pieces.normals), wanted.normals)
    return pieces


@pytest.mark.parametrize("name", ["a.ply", "a.xyz", "a.npy"])
def test_files_of_points(cloud, scratch, tmp_path, name):
    path = tmp_path / name
    if name == "a.npy":
        np.save(path, cloud.points)
    elif name == "a.xyz":
        np.savetxt(path, np.hstack([cloud.points, cloud.normals]))
    else:
        sf.write_mesh(path, cloud)
    check_cloud(path, scratch, sf.read_cloud(path))


def ply_of_points(path, columns, ending="<", body=None):
    """Write a binary PLY file with a vertex element of these columns, after another element."""
    kind = {"f": "float", "d": "double"}
    table = np.rec.fromarrays([array for _, array in columns], names=[n for n, _ in columns])
    order = "little" if ending == "<" else "big"
    lines = ["ply", f"format binary_{order}_endian 1.0", "element camera 1", "property float f"]
    lines += [f"element vertex {len(table)}"]
    lines += [f"property {kind[array.dtype.char]} {name}" for name, array in columns]
    lines += ["element face 0", "property list uchar int vertex_indices", "end_header", ""]
    content = table.astype(table.dtype.newbyteorder(ending)).tobytes() if body is None else body
    path.write_bytes("\n".join(lines).encode() + np.zeros(1, np.float32).tobytes() + content)


@pytest.mark.parametrize("ending", ["<", ">"])
def test_binary_plys_of_points_are_read_where_they_are(cloud, scratch, tmp_path, ending):
    path = tmp_path / "a.ply"
    axes = dict(zip("xyz", cloud.points.T, strict=True))
    vectors = dict(zip(("nx", "ny", "nz"), 3 * cloud.normals.T.astype(np.float32), strict=True))
    ply_of_points(path, [("z", axes["z"]), *vectors.items(), ("y", axes["y"]), ("x", axes["x"])],
                  ending)  # fmt: skip
    pieces = check_cloud(path, scratch, sf.read_cloud(path))
    assert isinstance(pieces.points.rows, RecordRows)
    assert pieces.points.rows.path == path


def test_plys_that_cannot_be_read_in_pieces_are_read_whole(cloud, scratch, tmp_path):
    path = tmp_path / "a.ply"
    lines = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
    path.write_text(lines + "property float z\nend_header\n0 0 0\n1 0 0\n")
    check_cloud(path, scratch, sf.read_cloud(path))
    columns = list(zip("xyz", cloud.points.T, strict=True))
    ply_of_points(path, [*columns, ("f", cloud.points[:, 0]), ("w", cloud.points[:, 0])])
    content = path.read_bytes()
    path.write_bytes(content.replace(b"property double w", b"property double f"))
    check_cloud(path, scratch, sf.read_cloud(path))  # two columns have the same name
    path.write_bytes(content.replace(b"property float f", b"property list uchar int f"))
    with pytest.raises(MeshError, match=r"a\.ply: "):  # the list before the points uses their bytes
        open_pieces(path, scratch, for_workers=False)
    other = b"element other 3\nproperty double q\nend_header"
    for cut in (content, content.replace(b"end_header", other, 1) + bytes(24)):
        path.write_bytes(cut[:-5])
        with pytest.raises(MeshError, match=r"a\.ply: .* truncated"):
            open_pieces(path, scratch, for_workers=False)
    path.write_text("ply\nformat binary_little_endian 1.0\nend_header\n")
    with pytest.raises(MeshError, match=r"a\.ply: the vertices of the PLY file have no property x"):
        open_pieces(path, scratch, for_workers=False)


@pytest.mark.parametrize("block", [16, 1 << 20])
@pytest.mark.parametrize("is_last", [True, False])
def test_lists_of_a_ply_of_points_are_skipped(
    cloud, scratch, tmp_path, monkeypatch, block, is_last
):
    monkeypatch.setattr("superfacets.io.readers.ply_body._BLOCK", block)
    path, points = tmp_path / "a.ply", cloud.points.astype("<f4").tobytes()
    vertex = [f"element vertex {cloud.n_points}", *(f"property float {axis}" for axis in "xyz")]
    line = ["element line 40", "property short a", "property list uchar int b"]
    elements = vertex + line if is_last else line + vertex
    head = "\n".join(["ply", "format binary_little_endian 1.0", *elements, "end_header\n"]).encode()
    lists = b"".join(bytes([7, 0, n]) + bytes(4 * n) for n in range(1, 41))
    content = head + (points + lists if is_last else lists + points)
    path.write_bytes(content + b"\0\n")
    pieces = check_cloud(path, scratch, sf.read_cloud(path))
    assert pieces.points.rows.path == path
    for damaged in (content[:-8], content[:-8_000], content + bytes(9) + b"\1" * 70):
        path.write_bytes(damaged)
        with pytest.raises(MeshError) as in_memory:
            sf.read_cloud(path)
        with pytest.raises(MeshError) as tiled:
            open_pieces(path, scratch, for_workers=False)
        assert str(tiled.value) == str(in_memory.value)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, ">f8", np.int32])
def test_npy_files_are_read_where_they_are(scratch, tmp_path, dtype):
    path = tmp_path / "a.npy"
    points = np.arange(90).reshape(-1, 3).astype(dtype)
    np.save(path, points)
    pieces = check_cloud(path, scratch, PointCloud(points))
    assert pieces.points.rows.path == path
    np.save(path, np.asfortranarray(points))
    check_cloud(path, scratch, PointCloud(points))
    np.save(path, np.hstack([points, np.tile(np.array([0, 0, 1], dtype), (30, 1))]))
    check_cloud(path, scratch, sf.read_cloud(path))  # colors
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(MeshError, match=r"a\.npy: .* the file may be truncated"):
        open_pieces(path, scratch, for_workers=False)


@pytest.mark.parametrize("for_workers", [False, True])
def test_arrays_of_points(cloud, scratch, tmp_path, for_workers):
    np.save(tmp_path / "a.npy", cloud.points.astype(np.float32))
    mapped = np.load(tmp_path / "a.npy", mmap_mode="r")
    bare = PointCloud(cloud.points)
    check_cloud(mapped, scratch, bare, for_workers=for_workers)
    check_cloud(cloud, scratch, cloud, for_workers=for_workers)
    pieces = open_pieces(mapped, scratch, for_workers=for_workers)
    assert isinstance(pieces.points.rows, RecordRows if for_workers else ArrayRows)


@pytest.mark.parametrize("shape", [(4,), (4, 2), (4, 3, 1)])
def test_arrays_that_are_no_points(scratch, shape):
    with pytest.raises(MeshError, match=r"points must be numbers of shape \(N, 3\)"):
        open_pieces(np.zeros(shape), scratch, for_workers=False)
    with pytest.raises(MeshError, match="the cloud has no points"):
        open_pieces(np.zeros((0, 3)), scratch, for_workers=False)


def test_a_folder_of_clouds(cloud, scratch, tmp_path):
    folder = tmp_path / "clouds"
    folder.mkdir()
    sf.write_mesh(folder / "b.ply", cloud)
    sf.write_mesh(folder / "a.ply", cloud)
    (folder / "labels.npy").write_bytes(b"of an earlier run")
    pieces = open_pieces(folder, scratch, for_workers=True)
    one = sf.read_cloud(folder / "a.ply")
    assert np.array_equal(pieces.points.read(400, 600), np.roll(one.points, 100, axis=0)[:200])
    assert np.array_equal(pieces.normals.read(400, 600), np.roll(one.normals, 100, axis=0)[:200])
    sf.write_mesh(folder / "c.ply", PointCloud(cloud.points))
    with pytest.raises(
        MeshError, match="either all or none of the point clouds in a folder must have normals"
    ):
        open_pieces(folder, scratch, for_workers=False)
    sf.write_mesh(folder / "c.ply", cube())
    with pytest.raises(
        MeshError, match="the folder has both meshes and point clouds: use separate folders"
    ):
        open_pieces(folder, scratch, for_workers=False)


def test_normals_that_are_not_finite_are_named(cloud, scratch, tmp_path):
    vectors = cloud.normals.astype(np.float32)
    vectors[321, 1] = np.nan
    columns = [*zip("xyz", cloud.points.T, strict=True)]
    columns += zip(("nx", "ny", "nz"), vectors.T, strict=True)
    ply_of_points(tmp_path / "a.ply", columns)
    pieces = open_pieces(tmp_path / "a.ply", scratch, for_workers=False)
    with pytest.raises(
        MeshError, match=r"normals\[321\] must be finite, got \[0.15829646587371826,"
    ):
        pieces.normals.read(300, 400)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no named pipes")
@pytest.mark.parametrize("name", ["a.ply", "a.obj"])
def test_pipes_are_refused_and_not_waited_for(tmp_path, name):
    folder = tmp_path / "meshes"
    folder.mkdir()
    os.mkfifo(folder / name)
    for source in (folder, folder / name):
        with pytest.raises(
            OSError, match=rf"{name}: is not a regular file, but a device or a pipe"
        ):
            sf.segment_tiled(source, 2, scratch=tmp_path)
