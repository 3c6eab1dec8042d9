"""No number of a file sizes anything before it is compared with the file.

`GUARDS` lists each place that sizes memory by anything but lengths in memory, with the reason why a
small file cannot make it large. A new place fails the test until it is listed here with its guard.
"""

import ast
import contextlib
import io
import struct
import tracemalloc
import zipfile
import zlib
from pathlib import Path

import pytest

import superfacets
from superfacets import MeshError, read_labels, read_masks
from superfacets.files.formats import FORMATS
from superfacets.files.readers.npy import npz_array
from superfacets.tools.cell_file import CellFile

SOURCE = Path(superfacets.__file__).parents[1]

TEXTURES = (
    "glb", "gltf_texture", "ids_image", "images", "mtl", "obj_texture", "ply_texture",
    "textures", "writing",
)  # fmt: skip
PLACES = (
    "superfacets/files", "superfacets/mesh/faces.py", "superfacets/mesh/meshes.py",
    "superfacets_formats",
    "superfacets_scans/label_images.py", "superfacets_scans/pinhole_camera.py",
    *(f"superfacets_textures/{name}.py" for name in TEXTURES),
    "superfacets_scans/lifting.py", "superfacets_scans/mask_votes.py", "superfacets_scans/masks.py",
)  # fmt: skip

GUARDS = {
    "superfacets/files/readers/labels.py": {("_expanded", "arange"): "the caller gives the number"},
    "superfacets_textures/glb.py": {
        ("_image", "frombuffer"): "a view of an encoded image in memory"},
    "superfacets_textures/ids_image.py": {
        ("_table_of_ids", "bincount"): "labels are below 2**24, checked in `write_ids`",
        ("write_ids", "bincount"): "labels are below 2**24, checked before",
        ("write_ids", "zeros"): "labels are below 2**24, checked before"},
    "superfacets/files/writers/text_formats.py": {
        ("_face_lines", "arange"): "sizes of faces in memory"},
    "superfacets/files/writers/ply.py": {
        ("_rows", "arange"): "the size of faces in memory",
        ("_write_elements", "arange"): "rows of cells in memory"},
    "superfacets_formats/vtk_writer.py": {
        ("write_vtk", "full"): "one entry per tetrahedron in memory"},
    "superfacets/files/guards.py": {
        ("numbers", "frombuffer"): "`skip` compares the size with the bytes that are left"},
    "superfacets_textures/images.py": {
        ("_open", "reader"): "`check_pixels` compares the pixels with the file"},
    "superfacets_scans/masks.py": {
        ("_picture", "reader"): "`check_pixels` compares the pixels with the file"},
    "superfacets_formats/compression.py": {
        ("decode_draco", "decode"): "counts of the data must equal those of accessors",
        ("decode_meshopt", "decode_gltf_buffer"): "`Gltf.take` limits the sum of sizes"},
    "superfacets_formats/cortex.py": {
        ("_decoded", "decompress"): "at most one byte more than declared, which is limited",
        ("_values_of", "frombuffer"): "a view of decoded bytes, whose number is checked"},
    "superfacets_formats/cortex_writer.py": {
        ("_write_annot", "arange"): "at most `_MOST_ROWS`"},
    "superfacets_formats/e57.py": {
        ("_read_columns", "reader"): "`_check_counts` compares all scans with the file",
        ("_joined", "arange"): "lengths of points in memory",
        ("_joined", "repeat"): "lengths of points in memory",
        ("_read_columns", "SourceDestBuffer"): "`_check_counts` compares all scans with the file",
        ("_read_columns", "empty"): "`_check_counts` compares all scans with the file",
        ("_viewpoints_of", "repeat"): "lengths of points in memory",
        ("read_e57", "E57"): "reads only the XML, which is in the file"},
    "superfacets/files/readers/gltf.py": {
        ("_labels", "frombuffer"): "a view of a buffer in memory",
        ("_triangles_of", "arange"): "corners of an accessor in memory",
        ("corners", "arange"): "vertices of an accessor in memory"},
    "superfacets/files/readers/gltf_file.py": {
        ("_rows_at", "ndarray"): "the end of the rows is compared with the view",
        ("rows", "zeros"): "`Gltf.take` limits the sum of sizes"},
    "superfacets_formats/grids.py": {
        ("_corners_of", "arange"): "corners in memory",
        ("_corners_of", "repeat"): "corners in memory"},
    "superfacets_formats/foreign.py": {
        ("_mesh_in", "repeat"): "cells in memory, of a process with a limit",
        ("_numbers_of", "full"): "vertices in memory",
        ("_values_of", "frombuffer"): "the size is compared with the section",
        ("_values_of", "full"): "the sum of sizes is compared with the file"},
    "superfacets_formats/las.py": {
        ("_add_extra_columns", "ndarray"): "a view of the records in memory",
        ("decompressed", "decompress_points_with_chunk_table"): "in a process with a limit",
        ("read_las", "frombuffer"): "the size is compared with the file"},
    "superfacets/files/readers/npy.py": {
        ("npy_array", "frombuffer"): "the declared size must be the size that follows"},
    "superfacets/files/readers/obj.py": {
        ("_read_blocks", "repeat"): "numbers of tokens in the text"},
    "superfacets_textures/obj_texture.py": {
        ("_add_coordinates", "repeat"): "numbers of tokens in the text",
        ("_add_materials", "empty"): "lines of the text"},
    "superfacets_formats/pcd.py": {
        ("_points_of", "frombuffer"): "8 bytes, or points whose number is compared with the file",
        ("write_pcd", "empty"): "at most ROWS_AT_ONCE rows of points in memory"},
    "superfacets_formats/splats.py": {
        ("between", "repeat"): "rows of the element chunk in memory",
        ("unpacked", "repeat"): "rows of the element chunk in memory"},
    "superfacets/files/readers/clouds.py": {("_names_in", "reader"): "a line of text"},
    "superfacets/files/readers/ply_tables.py": {
        ("_gather", "copy_runs"): "rows that `_walk` has found in the file",
        ("_gather", "frombuffer"): "a view of the whole file",
        ("_read_uniform", "frombuffer"): "the size of all rows is compared with the file",
        ("_walk", "frombuffer"): "a view of the whole file",
        ("_walk", "walk_rows"): "the rows were compared with the file"},
    "superfacets_textures/ply_texture.py": {
        ("_pairs_of_faces", "arange"): "corners in memory",
        ("_pairs_of_faces", "repeat"): "sizes of faces in memory"},
    "superfacets/files/readers/read.py": {
        ("_unpacked", "decompress"): "at most `most_bytes_of` the file"},
    "superfacets/files/readers/stl.py": {
        ("_triangles_in", "frombuffer"): "the count must give the size of the file"},
    "superfacets/files/readers/text.py": {
        ("_between", "frombuffer"): "a view of the whole file",
        ("runs", "arange"): "callers compare lengths with the file",
        ("runs", "repeat"): "callers compare lengths with the file",
        ("table", "arange"): "the width is a constant, or compared with the lines"},
    "superfacets_formats/vtk_xml.py": {
        ("_content", "frombuffer"): "`_first_bytes` compares the size with the data",
        ("_decoded", "frombuffer"): "a view of decoded bytes, whose number is checked",
        ("_unpacked", "decompress"): "at most one byte more than declared, which is limited"},
    "superfacets/mesh/faces.py": {
        ("corner_triangles", "repeat"): "sizes of faces in memory",
        ("of", "arange"): "sizes of faces in memory", ("of", "repeat"): "sizes of faces in memory",
        ("spread_indices", "arange"): "numbers of samples that the caller asks for"},
    "superfacets_scans/label_images.py": {
        ("_as_array", "zeros"): "at most the `MAX_PIXELS` of a camera"},
    "superfacets/mesh/meshes.py": {("triangulate", "repeat"): "sizes of faces in memory"},
    "superfacets_scans/lifting.py": {
        ("_by_image", "arange"): "images that were read",
        ("_objects_of_masks", "bincount"): "masks, of which each has a pixel",
        ("_without_gaps", "full"): "objects, of which each has a region",
        ("lift", "bincount"): "ranks of labels of regions",
        ("lift", "zeros"): "regions, of which each has a cell"},
    "superfacets_scans/mask_votes.py": {
        ("_visible_regions_of", "seen_cells"): "cameras have the sizes of their masks",
        ("collect_votes", "repeat"): "numbers of masks that were read"},
}  # fmt: skip
"""For each module, the guards of its places: (function, called name)."""


SIZED = {
    "empty": 0, "zeros": 0, "ones": 0, "full": 0, "arange": slice(None), "repeat": 1, "tile": 1,
    "bincount": 0, "frombuffer": 0, "fromfile": 0, "ndarray": 0,
}  # fmt: skip
"""Functions of NumPy whose result is sized by the argument at this place."""

LIBRARIES = {
    "decompress", "decompress_points_with_chunk_table", "read_chunk_table_only", "decode",
    "decode_gltf_buffer", "walk_rows", "copy_runs", "SourceDestBuffer",
    "E57", "seen_cells", "reader",
}  # fmt: skip
"""Other functions that allocate memory by numbers in files."""

IN_MEMORY = ("len", "min", "max", "int", "n_cells", "n_faces", "n_vertices", "n_points", "n_tets",
             "shape", "size", "stop", "start", "begin", "end")  # fmt: skip


def _is_in_memory(node):
    """Return whether a size has only constants and lengths of arrays in memory."""
    if isinstance(node, ast.Constant):
        return True
    if isinstance(node, ast.Tuple | ast.List):
        return all(map(_is_in_memory, node.elts))
    if isinstance(node, ast.BinOp):
        return _is_in_memory(node.left) and _is_in_memory(node.right)
    if isinstance(node, ast.Starred | ast.Subscript):
        return _is_in_memory(node.value)
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "len"
    return isinstance(node, ast.Attribute) and node.attr in IN_MEMORY


def _sites(path):
    """Yield the function and the called name of each sizing call of a module."""
    tree = ast.parse(path.read_text())
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        for node in ast.walk(function):
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func).rpartition(".")[2]
            is_numpy = ast.unparse(node.func).startswith("np.")
            if is_numpy and name in SIZED:
                place, is_view = SIZED[name], name in ("bincount", "frombuffer", "fromfile")
                given = node.args[place] if isinstance(place, slice) else [node.args[place]]
                if is_view or not all(map(_is_in_memory, given)):
                    yield function.name, name
            elif not is_numpy and name in LIBRARIES and _is_foreign(node.func):
                yield function.name, name


def _is_foreign(function):
    """Return whether a function is not the method `decode` of bytes."""
    text = ast.unparse(function)
    return text.startswith("library.") or not text.endswith(".decode")


def _found():
    files = [file for place in PLACES for file in _files(SOURCE / place)]
    return sorted({(f.relative_to(SOURCE).as_posix(), *site) for f in files for site in _sites(f)})


def _files(path):
    return sorted(path.rglob("*.py")) if path.is_dir() else [path]


def test_each_place_that_sizes_memory_has_a_guard():
    listed = {(file, *site) for file, sites in GUARDS.items() for site in sites}
    assert sorted({*_found()} - listed) == []  # compare the number with the file, then list it
    assert sorted(listed - {*_found()}) == []  # these places are gone


def _integers(*numbers):
    return struct.pack(f">{len(numbers)}i", *numbers)


HUGE = 2**31 - 1
GIFTI = b'<GIFTI><DataArray Intent="NIFTI_INTENT_LABEL" DataType="NIFTI_TYPE_INT32"'
LAS_1_2 = b"LASF" + bytes(20) + b"\1\2" + bytes(68)
ATTACKS = {
    "a.annot": _integers(1, 0, 0, 1, -2, HUGE, 2) + b"c\0" + _integers(HUGE, 0, 2) + b"a\0",
    "b.annot": _integers(HUGE),
    "a.white": b"\xff\xff\xfe\n\n" + _integers(HUGE, HUGE),
    "a.curv": b"\xff\xff\xff" + _integers(HUGE, 1, 1),
    "a.label.gii": GIFTI + b' Dimensionality="1" Dim0="99999999999"><Data/></DataArray></GIFTI>',
    "b.label.gii": GIFTI + b' Dimensionality="99999999999"><Data/></DataArray></GIFTI>',
    "a.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\n"
    b"property float x\nproperty float y\nproperty float z\nend_header\n",
    "b.ply": b"ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\n"
    b"property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\n"
    b"end_header\n0 0 0\n",
    "a.stl": b"x" * 80 + struct.pack("<I", 2**32 - 1) + bytes(50),
    "a.off": b"OFF\n99999999999 99999999999 0\n0 0 0\n",
    "b.off": b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n99999999999 0 1 2\n",
    "a.mesh": b"MeshVersionFormatted 2\nDimension 3\nVertices\n99999999999\n0 0 0 0\n",
    "a.msh": b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 99999999999 1 9\n"
    b"0 1 0 99999999999\n",
    "a.vtk": b"# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    b"POINTS 99999999999 double\n0 0 0\n",
    "a.vtp": b'<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="99999999999"'
    b' NumberOfPolys="1"><Points><DataArray type="Float32" NumberOfComponents="3"/></Points>'
    b"</Piece></PolyData></VTKFile>",
    "a.pcd": b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 99999999999\nHEIGHT 1\n"
    b"DATA binary_compressed\n" + struct.pack("<2I", 4, 2**32 - 1) + bytes(4),
    "b.pcd": b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 99999999\nPOINTS 1\nDATA ascii\n1\n",
    "a.las": LAS_1_2 + struct.pack("<HIIBHI", 227, 227, HUGE, 0, 20, HUGE) + bytes(120),
    "a.laz": LAS_1_2 + struct.pack("<HIIBHI", 227, 227, 0, 128, 20, HUGE) + bytes(120),
    "a.gltf": b'{"asset":{"version":"2.0"},"buffers":[{"byteLength":99999999999}]}',
    "a.npy": b"\x93NUMPY\1\0\x46\0{'descr': '<i8', 'fortran_order': False, 'shape': (99999999999,)}"
    + b" " * 6 + b"\n",
    "a.obj": b"v 0 0 0\nf 1 99999999999 -99999999999\n",
}  # fmt: skip
"""Small files that declare large sizes."""


@pytest.mark.parametrize("name", ATTACKS)
def test_a_small_file_that_declares_much_is_refused_without_memory(tmp_path, name):
    (tmp_path / name).write_bytes(ATTACKS[name])
    has_labels = name.endswith((*FORMATS["vertex_labels"], ".npy"))
    with refused_within(32 << 20):
        read_labels(tmp_path / name) if has_labels else CellFile.read(tmp_path / name).cells()


def test_archives_and_pictures_that_declare_much_are_refused_without_memory(tmp_path):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("labels.npy", bytes(80 << 20))
    with refused_within(32 << 20):
        npz_array(packed.getvalue(), "labels")
    pytest.importorskip("PIL")
    head = struct.pack(">4s2I5B", b"IHDR", 65536, 65536, 8, 0, 0, 0, 0)
    picture = b"\x89PNG\r\n\x1a\n\0\0\0\r" + head + struct.pack(">I", zlib.crc32(head))
    data = b"IDAT" + zlib.compress(b"")
    body = struct.pack(">I", len(data) - 4) + data + struct.pack(">I", zlib.crc32(data))
    (tmp_path / "a.png").write_bytes(picture + body + b"\0\0\0\0IEND\xaeB`\x82")
    with refused_within(32 << 20):
        read_masks(tmp_path)


@contextlib.contextmanager
def refused_within(n_bytes):
    """Check that the block raises a MeshError of one line, and allocates at most `n_bytes`."""
    tracemalloc.start()
    try:
        with pytest.raises(MeshError) as caught:
            yield
        assert tracemalloc.get_traced_memory()[1] < n_bytes
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)
