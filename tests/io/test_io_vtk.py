"""Files of VTK, Gmsh and Medit: written by their libraries, truncated, and with false sizes."""

import itertools
import re
import struct

import numpy as np
import pytest

import superfacets as sf
from superfacets.tools.cell_file import CellFile

meshio = pytest.importorskip("meshio")
vtk = pytest.importorskip("vtk")
numpy_to_vtk = pytest.importorskip("vtkmodules.util.numpy_support").numpy_to_vtk

POINTS = np.random.default_rng(0).random((16, 3)).round(3)  # the precision of VTK's text files
TETS = np.random.default_rng(1).permuted(np.tile(np.arange(16), (18, 1)), axis=1)[:, :4]
LABELS = np.arange(18) % 5
SIDES = TETS[:2, :3]
POLYGONS = [[0, 1, 3, 2], [4, 5, 6], [0, 4, 5, 6, 1]]


def cells_of(rows):
    cells = vtk.vtkCellArray()
    for row in rows:
        cells.InsertNextCell(len(row), [*map(int, row)])
    return cells


def with_labels(data, labels):
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(POINTS, deep=True))
    data.SetPoints(points)
    array = numpy_to_vtk(np.asarray(labels, np.int32), deep=True)
    array.SetName("label")
    data.GetCellData().AddArray(array)
    return data


def grid():
    """Return a grid of triangles followed by tetrahedra."""
    data = vtk.vtkUnstructuredGrid()
    data.SetCells([5] * 2 + [10] * 18, cells_of([*SIDES, *TETS]))
    return with_labels(data, [9, 9, *LABELS])


def surface():
    """Return a point followed by polygons."""
    data = vtk.vtkPolyData()
    data.SetVerts(cells_of([[2]]))
    data.SetPolys(cells_of(POLYGONS))
    return with_labels(data, [9, 3, 1, 2])


def check(path):
    mesh = sf.read_mesh(path)
    assert np.array_equal(mesh.vertices, POINTS)
    if path.suffix == ".vtp":
        assert [mesh.face(i).tolist() for i in range(3)] == POLYGONS
        assert sf.read_labels(path, 3).tolist() == [3, 1, 2]
    else:
        assert np.array_equal(mesh.tets, TETS)
        assert np.array_equal(sf.read_labels(path, 18), LABELS)


XML = {
    ".vtp": (vtk.vtkXMLPolyDataWriter, surface),
    ".vtu": (vtk.vtkXMLUnstructuredGridWriter, grid),
}


@pytest.mark.parametrize("ending", XML)
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZMA"])
@pytest.mark.parametrize("form", ["ascii", "inline", "appended", "raw"])
def test_xml_of_vtk_is_read_in_every_form(tmp_path, ending, compressor, form):
    for size, order in itertools.product((32, 64), (0, 1)):
        make, data = XML[ending]
        writer = make()
        writer.SetInputData(data())
        writer.SetDataMode(["ascii", "inline", "appended"].index(form) if form != "raw" else 2)
        writer.SetEncodeAppendedData(form != "raw")
        writer.SetHeaderType(size)
        writer.SetByteOrder(order)
        writer.SetBlockSize(64)  # bytes: several blocks, of which the last may be smaller
        getattr(writer, f"SetCompressorTypeTo{compressor}")()
        writer.SetFileName(str(tmp_path / f"a{ending}"))
        writer.Write()
        check(tmp_path / f"a{ending}")


def test_pieces_are_joined_and_vtk_reads_lz4(tmp_path):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid())
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetNumberOfPieces(2)
    writer.Write()
    mesh = sf.read_mesh(tmp_path / "a.vtu")
    assert np.array_equal(mesh.tets, [*TETS, *(TETS + 16)])
    assert np.array_equal(sf.read_labels(tmp_path / "a.vtu"), [*LABELS, *LABELS])
    writer.SetCompressorTypeToLZ4()
    writer.Write()
    assert np.array_equal(sf.read_mesh(tmp_path / "a.vtu").tets, mesh.tets)
    assert np.array_equal(sf.read_labels(tmp_path / "a.vtu"), [*LABELS, *LABELS])


@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("version", [42, 51])
def test_legacy_files_of_all_versions_are_read(tmp_path, version, is_binary):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetInputData(grid())
    writer.SetFileVersion(version)
    writer.SetFileType(2 if is_binary else 1)
    writer.SetFileName(str(tmp_path / "a.vtk"))
    writer.Write()
    check(tmp_path / "a.vtk")


CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]


def numbered_msh(version, is_text, nodes):
    """Return a triangle and two tetrahedra with data; the numbers of the cells are 6, 9 and 2."""

    def row(form, *numbers):
        text = f"{' '.join(map(str, numbers))}\n"
        return text.encode() if is_text else struct.pack(f"<{form}", *numbers)

    parts = [f"$MeshFormat\n{version} {int(not is_text)} 8\n".encode()]
    parts += [b"" if is_text else row("i", 1), b"\n$EndMeshFormat\n$Nodes\n"]
    points = list(zip(nodes, CORNERS, strict=True))
    cells = [(6, 2, nodes[:3]), (9, 4, nodes[:4]), (2, 4, nodes[1:])]
    if version < 4:
        parts += [b"5\n", *(row("i3d", node, *point) for node, point in points)]
        parts += [b"\n$EndNodes\n$Elements\n3\n"]
        for number, kind, corners in cells:
            head = (number, kind, 2) if is_text else (kind, 1, 2, number)
            parts.append(row(f"{len(head) + 2 + len(corners)}i", *head, 0, 1, *corners))
    else:
        parts.append(row("4Q", 3, 5, 4, 30))
        for block in (points[:2], points[2:], []):
            parts += [row("3iQ", 3, 1, 0, len(block)), *(row("Q", node) for node, _ in block)]
            parts += [row("3d", *point) for _, point in block]
        parts += [b"\n$EndNodes\n$Elements\n", row("4Q", 3, 3, 2, 9)]
        for number, kind, corners in cells:
            parts.append(row(f"3i{2 + len(corners)}Q", 2, 1, kind, 1, number, *corners))
    parts.append(b'\n$EndElements\n$NodeData\n1\n"heat"\n1\n0.5\n3\n0\n1\n3\n')
    parts += [row("id", nodes[place], place + 0.5) for place in (4, 0, 3)]
    parts.append(b'\n$EndNodeData\n$ElementData\n1\n"flow"\n1\n0.5\n3\n0\n3\n2\n')
    parts += [row("i3d", number, number, 0.5, 0) for number in (2, 9)]
    return b"".join([*parts, b"\n$EndElementData\n"])


@pytest.mark.parametrize("is_text", [True, False])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_data_of_msh_belong_to_the_numbers_of_nodes_and_cells(tmp_path, version, is_text):
    nodes = [30, 7, 8, 4, 5] if is_text or version > 4 else [1, 2, 3, 4, 5]
    (tmp_path / "a.msh").write_bytes(numbered_msh(version, is_text, nodes))
    mesh, attributes = CellFile.read(tmp_path / "a.msh").cells_and_attributes()
    assert mesh.tets.tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert str(attributes.vertex["heat"].tolist()) == "[0.5, nan, nan, 3.5, 4.5]"
    assert attributes.face["flow"].tolist() == [[9, 0.5, 0], [2, 0.5, 0]]
    assert attributes.left_out == ("1 cell of type triangle",)


@pytest.mark.parametrize(("text", "other", "message"), [
    ("\n30 0.5\n", "\n31 0.5\n", "number 31, which no node or"),
    ("\n30 0.5\n", "\n5 0.5\n", "two rows have the number 5"),
    ("$Nodes\n5\n", "$Nodes\n6\n7 9 9 9\n", "two nodes or elements have the number 7"),
    ("\n30 0.5\n", "\n30.5 0.5\n", "must be integers, got 30.5"),
    ("\n30 0.5\n", "\n30\n", "3 rows of 1 value, but has more or less"),
    ("\n0\n1\n3\n", "\n0\n1\n2\n", "2 rows of 1 value, but has more or less"),
    ("\n0\n1\n3\n", "\n0\n1\n0\n", "0 rows of 1 value, but has more or less"),
    ("\n0\n1\n3\n", f"\n0\n1\n{10**30}\n", "integer tags must be integers >= 0, got '1000"),
    ("\n0\n1\n3\n", "\n0\n20000000\n0\n", "0 rows of 20000000 values, too many for the file"),
    ("\n3\n0\n1\n3\n", "\n2\n0\n1\n", "expected 3 integer tags, got 2"),
    ("$EndNodeData\n", "", "$NodeData has no end"),
    ("$Elements\n3\n", "$Elements\n2\n", "$Elements has other rows than it declares"),
    ("$Nodes", "$Nodes\n$EndNodes\n$Nodes", "expected one section $Nodes, got 2"),
    ("$EndNodes", "$EndNodes\n9 9 9", "expected a section like $Nodes, got '9 9 9"),
])  # fmt: skip
def test_data_of_msh_that_cannot_be_assigned_are_refused(refuse, text, other, message):
    content = numbered_msh(2.2, True, [30, 7, 8, 4, 5])
    refuse("a.msh", content.replace(text.encode(), other.encode(), 1), message)


def test_sections_of_msh_have_any_order_and_others_are_named(refuse, tmp_path):
    refuse("c.msh", numbered_msh(2.2, False, [30, 7, 8, 4, 5]), "nodes that are not 1, 2, 3")
    content = numbered_msh(2.2, True, [30, 7, 8, 4, 5]).replace(b"flow", b"gmsh:physical")
    head, mesh, data = re.split(rb"(?=\$Nodes|\$NodeData)", content)
    others = b'$PhysicalNames\n1\n2 1 "\xe9"\n$EndPhysicalNames\n$Comments\n$Nodes\n$EndComments\n'
    (tmp_path / "d.msh").write_bytes(head + others + data + mesh + data)
    attributes = sf.read_attributes(tmp_path / "d.msh")
    assert str(attributes.vertex["heat"].tolist()) == "[0.5, nan, nan, 3.5, 4.5]"
    assert [name for name in attributes.left_out if name.startswith("field")] == [
        "field $Comments, which is not read", "field heat, whose name is repeated",
        "field gmsh:physical, whose name is repeated",
    ]  # fmt: skip
    mesh = meshio.Mesh(POINTS, [("tetra", TETS)], {"heat": POINTS})
    meshio.gmsh.main.write(tmp_path / "e.msh", mesh, "4.0")
    attributes = sf.read_attributes(tmp_path / "e.msh")
    assert np.array_equal(attributes.vertex["heat"], POINTS)
    assert attributes.left_out == ()


POLYDATA = (
    '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
    "<PolyData>"
    '<Piece NumberOfPoints="3" NumberOfPolys="1"><Points><DataArray type="Float64"'
    ' NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points><Polys>'
    '<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>'
    '<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>'
    "</Polys></Piece></PolyData></VTKFile>"
)
HUGE = 10**10


@pytest.mark.parametrize(("name", "text", "message"), [
    ("a.vtp", POLYDATA.replace('Points="3"', f'Points="{HUGE}"'),
     f"it declares {3 * HUGE} numbers, too many for the file size"),
    ("a.vtp", POLYDATA.replace('Polys="1"', f'Polys="{HUGE}"'),
     f"it declares {HUGE} numbers, too many for the file size"),
    ("a.vtp", POLYDATA.replace('Components="3"', f'Components="{HUGE}"'), "3 components"),
    ("a.vtp", POLYDATA.replace(">3<", ">300000000<"),
     "it declares 300000000 numbers, too many for the file size"),
    ("a.vtp", POLYDATA.replace(">3<", ">-3<"),
     "the offsets of Polys must be non-negative and ascending"),
    ("a.vtp", POLYDATA.replace("0 1 2<", "0 1 2 0<"), "expected 3 numbers, got 4"),
    ("a.vtp", POLYDATA.replace('Points="3"', 'Points="-1"'),
     "NumberOfPoints must be integers >= 0, got '-1'"),
    ("a.vtp", "<!DOCTYPE x []>" + POLYDATA,
     "the XML must not have a DOCTYPE, which VTK files never have"),
    ("a.vtk", "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
     f"POINTS {HUGE} double\n" + " " * 100, "VTK cannot read the file"),
    ("a.vtk", "# vtk DataFile Version 5.1\nx\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\n"
     "POLYGONS 2 3\nOFFSETS vtktypeint32\n0 3\n", "vtktypeint32: save it as .vtu or .vtp"),
    ("a.msh", f"$MeshFormat\n2.2 1 8\n\1\0\0\0\n$EndMeshFormat\n$Nodes\n{HUGE}\n" + "\0" * 50,
     "$Nodes has no end"),
    ("a.mesh", f"MeshVersionFormatted 1\nDimension 3\nVertices\n{HUGE}\n0 0 0 1\nEnd\n",
     "memory"),
])  # fmt: skip
def test_sizes_are_compared_with_the_file_before_memory_is_taken(refuse, name, text, message):
    refuse(name, text.encode("latin-1"), message)


@pytest.mark.parametrize("name", ["a.vtp", "a.vtu", "a.vtk"])
@pytest.mark.parametrize("ascii", [False, True])
def test_any_name_of_labels_is_written_such_that_vtk_reads_it(tmp_path, name, ascii):
    pyvista = pytest.importorskip("pyvista")
    label_name, path, ids = 'a<b> & "c" 100%', tmp_path / name, LABELS + 2**60
    mesh = sf.Mesh(POINTS, TETS[:, :3]) if name == "a.vtp" else sf.TetMesh(POINTS, TETS)
    attributes = sf.MeshAttributes(face={"an id": ids})
    sf.write_mesh(path, mesh, LABELS, ascii=ascii, label_name=label_name, attributes=attributes)
    assert np.array_equal(sf.read_labels(path, name=label_name), LABELS)
    other = pyvista.read(path)
    assert np.array_equal(other.points, POINTS)
    corners = other.regular_faces if name == "a.vtp" else other.cells.reshape(-1, 5)[:, 1:]
    assert np.array_equal(corners, mesh.faces if name == "a.vtp" else mesh.tets)
    assert np.array_equal(other.cell_data[label_name], LABELS)
    assert other.cell_data[label_name].dtype == np.int32
    for found in (other.cell_data["an id"], sf.read_attributes(path).face["an id"]):
        assert found.dtype == np.int64
        assert np.array_equal(found, ids)
