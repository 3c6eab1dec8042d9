"""Files of VTK, Gmsh and Medit: written by their libraries, truncated, and with false sizes."""

import itertools

import numpy as np
import pytest

import superfacets as sf

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
        ids = vtk.vtkIdList()
        for index in row:
            ids.InsertNextId(int(index))
        cells.InsertNextCell(ids)
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


def legacy(path, version, is_binary):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetInputData(grid())
    writer.SetFileVersion(version)
    writer.SetFileType(2 if is_binary else 1)
    writer.SetFileName(str(path))
    writer.Write()


def gmsh(path, format, is_binary):
    blocks = [("triangle", TETS[:3, :3]), ("tetra", TETS)][format == "gmsh" :]  # 4.1: one block
    parts = [np.full(3, 9.0), LABELS.astype(float)][-len(blocks) :]
    mesh = meshio.Mesh(POINTS, blocks, cell_data={"label": parts} if is_binary else {})
    mesh.write(path, file_format=format, binary=is_binary)
    if not is_binary:  # meshio writes text data that cannot be read
        rows = [f"{i + 1} {label}" for i, label in enumerate(np.concatenate(parts))]
        data = ["$ElementData", 1, "label", 1, 0, 3, 0, 1, len(rows), *rows, "$EndElementData"]
        path.write_text(path.read_text() + "\n".join(map(str, data)) + "\n")


FLAVOURS = {
    "ascii-4.vtk": (legacy, 42, False), "binary-4.vtk": (legacy, 42, True),
    "ascii-5.vtk": (legacy, 51, False), "binary-5.vtk": (legacy, 51, True),
    "ascii-2.msh": (gmsh, "gmsh22", False), "binary-2.msh": (gmsh, "gmsh22", True),
    "ascii-4.msh": (gmsh, "gmsh", False), "binary-4.msh": (gmsh, "gmsh", True),
}  # fmt: skip


@pytest.mark.parametrize("name", FLAVOURS)
def test_every_flavor_is_read(tmp_path, name):
    make, *options = FLAVOURS[name]
    make(tmp_path / name, *options)
    check(tmp_path / name)


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
    (
        "a.vtk",
        "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {HUGE} double\n" + " " * 100,
        "VTK cannot read the file",
    ),
    ("a.msh", f"$MeshFormat\n2.2 1 8\n\1\0\0\0\n$EndMeshFormat\n$Nodes\n{HUGE}\n" + "\0" * 50,
     "no end of its nodes"),
    ("a.mesh", f"MeshVersionFormatted 1\nDimension 3\nVertices\n{HUGE}\n0 0 0 1\nEnd\n",
     "memory"),
])  # fmt: skip
def test_sizes_are_compared_with_the_file_before_memory_is_taken(refuse, name, text, message):
    refuse(name, text.encode("latin-1"), message)


@pytest.mark.parametrize("name", ["a.vtp", "a.vtu", "a.vtk"])
@pytest.mark.parametrize("ascii", [False, True])
def test_any_name_of_labels_is_written_such_that_vtk_reads_it(tmp_path, name, ascii):
    pyvista = pytest.importorskip("pyvista")
    label_name, path = 'a<b> & "c" 100%', tmp_path / name
    mesh = sf.Mesh(POINTS, TETS[:, :3]) if name == "a.vtp" else sf.TetMesh(POINTS, TETS)
    sf.write_mesh(path, mesh, LABELS, ascii=ascii, label_name=label_name)
    assert np.array_equal(sf.read_labels(path, name=label_name), LABELS)
    other = pyvista.read(path)
    assert np.array_equal(other.points, POINTS)
    corners = other.regular_faces if name == "a.vtp" else other.cells.reshape(-1, 5)[:, 1:]
    assert np.array_equal(corners, mesh.faces if name == "a.vtp" else mesh.tets)
    assert np.array_equal(other.cell_data[label_name], LABELS)
    assert other.cell_data[label_name].dtype == np.int32
