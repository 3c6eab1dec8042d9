"""What a file declares comes out again, or is named, in each format and from one into another."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from test_io_gltf_features import Document
from test_io_textures import png_bytes

from superfacets import Mesh, MeshAttributes, TetMesh, write_mesh
from superfacets.files.formats import FORMATS
from superfacets.files.writers.write import OutputFiles
from superfacets.graph.kinds import kind_of
from superfacets.tools.cell_file import CellFile

POINTS = "0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n"

PLY = f"""ply
format ascii 1.0
comment by hand
comment names part ["lid", "box"]
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property double heat
property list uchar float pair
element face 2
property list uchar int vertex_indices
property int label
property short part
element edge 1
property int vertex1
end_header
{POINTS.replace(chr(10), " 1 2 3 0.1 2 5 6" + chr(10))}3 0 1 2 7 0
3 0 2 3 -1 1
4
"""

OBJ = f"""mtllib a.mtl
{"".join(f"v {row} 1 0.2 0" + chr(10) for row in POINTS.splitlines())}vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
g inlet
usemtl wood
f 1/1/1 2/2/1 3/3/1
g outlet
f 1/1/1 3/3/1 4/2/1
l 1 2
"""

FACET = "facet normal 0 0 1\nouter loop\nvertex {}\nvertex {}\nvertex {}\nendloop\nendfacet\n"
ROWS = POINTS.splitlines()
STL = "".join(
    f"solid {name}\n{FACET.format(*(ROWS[i] for i in face))}endsolid {name}\n"
    for name, face in (("inlet", (0, 1, 2)), ("out let", (0, 2, 3)))
)

OFF = "OFF\n4 2 0\n" + POINTS + "3 0 1 2 255 0 0\n3 0 2 3 0 128 9\n"

VTK = f"""# vtk DataFile Version 3.0
title
ASCII
DATASET POLYDATA
POINTS 4 double
{POINTS}LINES 1 3
2 0 1
POLYGONS 2 8
3 0 1 2
3 0 2 3
CELL_DATA 3
SCALARS zone int 1
LOOKUP_TABLE default
9 4 5
POINT_DATA 4
FIELD FieldData 2
press 1 4 float
1 2 3 4
flow 3 4 double
{POINTS}"""

TETS = f"""# vtk DataFile Version 3.0
title
ASCII
DATASET UNSTRUCTURED_GRID
FIELD FieldData 1
time 1 1 double
0.5
POINTS 4 double
{POINTS}CELLS 2 9
4 0 1 2 3
3 0 1 2
CELL_TYPES 2
10
5
CELL_DATA 2
FIELD FieldData 2
label 1 2 int
3 4
size 1 2 float
1.5 2
POINT_DATA 4
FIELD FieldData 1
heat 1 4 double
1 2 3 4
"""


def array_of(name, kind, text, more=""):
    return f'<DataArray type="{kind}" Name="{name}" format="ascii" {more}>{text}</DataArray>'


DATA = (
    f"<FieldData>{array_of('time', 'Float64', '1')}</FieldData>"
    f"<PointData>{array_of('press', 'Float32', '1 2 3 4')}"
    '<Array type="String" Name="who" format="ascii">65 0</Array>'
    '<DataArray type="String" Name="old" format="ascii">65 0</DataArray></PointData>'
)
THREE = 'NumberOfComponents="3"'
XML_POINTS = f"<Points>{array_of('Points', 'Float64', POINTS, THREE)}</Points>"
VTP = f"""<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="4" NumberOfVerts="0" NumberOfLines="1" NumberOfStrips="0" NumberOfPolys="2">
{DATA}<CellData>{array_of("zone", "Int64", "9 4 5")}</CellData>{XML_POINTS}
<Lines>{array_of("connectivity", "Int32", "0 1")}{array_of("offsets", "Int32", "2")}</Lines>
<Polys>{array_of("connectivity", "Int32", "0 1 2 0 2 3")}{array_of("offsets", "Int32", "3 6")}
</Polys></Piece></PolyData></VTKFile>"""
VTU = f"""<VTKFile type="UnstructuredGrid" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="2">
{DATA}<CellData>{array_of("label", "Int32", "3 4")}</CellData>{XML_POINTS}
<Cells>{array_of("connectivity", "Int32", "0 1 2 3 0 0 1 0 0 1 0 1")}
{array_of("offsets", "Int32", "10 12")}{array_of("types", "UInt8", "24 3")}</Cells>
</Piece></UnstructuredGrid></VTKFile>"""

MSH = f"""$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "inlet"
2 3 "wall"
$EndPhysicalNames
$Nodes
4
{"".join(f"{i + 1} {row}" + chr(10) for i, row in enumerate(ROWS))}$EndNodes
$Elements
3
1 1 2 8 8 1 2
2 2 2 1 5 1 2 3
3 2 2 3 6 1 3 4
$EndElements
"""

MEDIT = f"""MeshVersionFormatted 2
Dimension 3
Vertices
4
{POINTS.replace(chr(10), " 7" + chr(10))}Triangles
2
1 2 3 5
1 3 4 6
Edges
1
1 2 8
End
"""

GIFTI_ARRAY = (
    '<DataArray Intent="NIFTI_INTENT_{}" DataType="NIFTI_TYPE_{}" Dimensionality="{}" Dim0="{}"'
    ' {} ArrayIndexingOrder="RowMajorOrder" Encoding="ASCII" Endian="LittleEndian"><MetaData>{}'
    "</MetaData>{}<Data>{}</Data></DataArray>"
)
GIFTI_MD = "<MD><Name>AnatomicalStructurePrimary</Name><Value>CortexLeft</Value></MD>"
GIFTI_MD += "".join(map("<MD><Name>{}</Name><Value>1</Value></MD>".format, "ebdac"))
MATRIX = (
    "<CoordinateSystemTransformMatrix><MatrixData>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</MatrixData>"
    "</CoordinateSystemTransformMatrix>"
)
GIFTI = (
    '<GIFTI Version="1.0" NumberOfDataArrays="3">'
    + GIFTI_ARRAY.format("POINTSET", "FLOAT32", 2, 4, 'Dim1="3"', GIFTI_MD, MATRIX, POINTS)
    + GIFTI_ARRAY.format("TRIANGLE", "INT32", 2, 2, 'Dim1="3"', "", "", "0 1 2 0 2 3")
    + GIFTI_ARRAY.format("SHAPE", "FLOAT32", 1, 4, "", "", "", "1 2 3 4")
    + GIFTI_ARRAY.format("SHAPE", "FLOAT32", 1, 2, "", "", "", "1 2")
    + "</GIFTI>"
)


def everything_of_gltf():
    """Return a GLB with colors, ids of features, normals, a texture, lines and a camera."""
    document = Document()
    rows = {"COLOR_0": [[1, 0.5, 0]], "NORMAL": [[0, 0, 1]], "_FEATURE_ID_0": [4]}
    added = {name: document.add(np.array(row * 4, "<f4")) for name, row in rows.items()}
    pairs = document.add(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], "<f4"))
    primitive = {**document.square(**added, TEXCOORD_0=pairs), "material": 0}
    lines = {"attributes": {"POSITION": primitive["attributes"]["POSITION"]}, "mode": 1}
    image = document.view(np.frombuffer(png_bytes(), np.uint8))
    return document.content(
        primitive, mesh={"primitives": [primitive, lines]}, cameras=[{"type": "perspective"}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        textures=[{"source": 0}], images=[{"bufferView": image, "mimeType": "image/png"}],
    )  # fmt: skip


FILES = {
    "a.ply": PLY, "a.obj": OBJ, "a.stl": STL, "a.off": OFF, "a.vtk": VTK, "tets.vtk": TETS,
    "a.vtp": VTP, "a.vtu": VTU, "a.msh": MSH, "a.mesh": MEDIT, "a.gii": GIFTI,
    "a.glb": everything_of_gltf(),
}  # fmt: skip


TEXTS = ["texts who of PointData", "texts old of PointData"]
FIELD = "field time, which belongs to neither points nor cells"
LEFT_OUT = {
    "a.ply": ["element edge"],
    "a.obj": ["vn (normals)", "l (lines)"],
    "a.vtk": ["1 cell of type polyline"],
    "tets.vtk": [FIELD, "1 cell of type triangle"],
    "a.vtp": [*TEXTS, FIELD, "1 cell in Lines, which has no polygons"],
    "a.vtu": [*TEXTS, FIELD, "1 cell of type line", "nodes on edges of 1 cell of type tetra10"],
    "a.msh": ["1 cell of type line"],
    "a.mesh": ["1 cell of type line"],
    "a.gii": [*(f"metadata {name}" for name in "ebdac"), "transform of coordinates",
              "vertex property shape (2), which has no row per vertex"],
    "a.glb": ["1 camera", "vertex attribute NORMAL", "lines"],
}  # fmt: skip
"""What readers leave out of these files. It is all of the rest that comes back."""


def read(path, content=None):
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return CellFile.read(path).cells_and_attributes()


def check_equal(found, expected):
    (cells, attributes), (wanted, given) = found, expected
    corners, before = (kind_of(each).corners(each).vertices for each in (cells, wanted))
    assert_array_equal(cells.vertices, wanted.vertices[: cells.n_vertices])
    assert_array_equal(corners, before)
    for owner, n_rows in (("vertex", cells.n_vertices), ("face", cells.n_cells)):
        stored = getattr(attributes, owner)
        for name, values in getattr(given, owner).items():
            assert_array_equal(stored[name], values[:n_rows], strict=True)
    words = {key: [name.replace(" ", "_") for name in names] for key, names in given.names.items()}
    found_words = {
        key: [name.replace(" ", "_") for name in names] for key, names in attributes.names.items()
    }
    assert found_words == words
    assert attributes.comments == given.comments
    if given.texture is not None:
        of_corners, of_given = (
            each.coordinates[each.corners] for each in (attributes.texture, given.texture)
        )
        assert_array_equal(of_corners, of_given)
        assert len(attributes.texture.materials) == len(given.texture.materials)


@pytest.mark.parametrize("name", FILES)
def test_a_file_with_everything_comes_back_or_is_named(name, tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl wood\nKd 1 0 0\n")
    cells, attributes = read(tmp_path / name, FILES[name])
    assert [*attributes.left_out] == LEFT_OUT.get(name, [])
    writers = FORMATS.writers[kind_of(cells).name]
    ending = name[name.index(".") :]
    ending = ending if ending in writers else next(iter(writers))
    labels = attributes.face.get("label", attributes.face.get("feature_id"))
    lost = OutputFiles([tmp_path / f"b{ending}"]).write(cells, labels, attributes=attributes).lost
    found = read(tmp_path / f"b{ending}")
    if name == "a.glb":  # colors beside labels are those of regions, and ids have a table
        assert lost == {".glb": ["face property feature_id"]}
        assert_array_equal(found[1].face["label"], labels)
        lost, attributes = {ending: []}, MeshAttributes(texture=attributes.texture)
    assert lost == {ending: []}
    check_equal(found, (cells, attributes))


@pytest.mark.parametrize(("ending", "lost"), [
    (".ply", []),
    (".vtp", ["part names", "comments"]),
    (".obj", ["vertex property heat", "comments"]),
    (".stl", ["vertex properties red, green, blue, heat", "comments"]),
    (".off", ["vertex properties red, green, blue, heat", "face property part",
              "part names", "comments"]),
    (".glb", ["vertex property heat", "face property part", "part names", "comments"]),
])  # fmt: skip
def test_a_warning_names_what_another_format_does_not_store(ending, lost, tmp_path):
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], [[0, 1, 2], [0, 2, 3]])
    colors = {name: np.array([0, 7, 128, 255], np.uint8) for name in ("red", "green", "blue")}
    attributes = MeshAttributes(
        {**colors, "heat": [1.0, 2.0, 3.0, 4.0]}, {"part": np.array([0, 1])}, ["comment by hand"],
        names={"part": ("lid", "box")},
    )  # fmt: skip
    path = tmp_path / f"a{ending}"
    if lost:
        with pytest.warns(UserWarning, match="does not store") as caught:
            write_mesh(path, mesh, attributes=attributes)
        assert str(caught[0].message) == f"{ending} does not store: {'; '.join(lost)}"
    else:
        write_mesh(path, mesh, attributes=attributes)
    found = read(path)[1]
    if "vertex properties red, green, blue, heat" not in lost:
        assert all((found.vertex[name] == colors[name]).all() for name in colors)
    if "part names" not in lost:
        assert [*found.names.values()] == [("lid", "box")]


@pytest.mark.parametrize("ending", [".vtu", ".vtk"])
def test_tetrahedra_keep_their_data(ending, tmp_path):
    mesh = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    attributes = MeshAttributes({"flow": np.eye(4, 3)}, {"zone": np.array([4], np.int16)})
    write_mesh(tmp_path / f"a{ending}", mesh, [3], attributes=attributes)
    found = read(tmp_path / f"a{ending}")[1]
    assert_array_equal(found.vertex["flow"], np.eye(4, 3))
    assert (found.face["zone"], found.face["label"]) == ([4], [3])


def test_fields_of_vertices_in_off_are_attributes(tmp_path):
    rows = ["0 0 1 255 0 0 255 .5 .5", "0 0 1 0 255 9 128 0 1", "0 0 1 1 2 3 4 1 1"]
    text = "STCNOFF\n3 1 0\n" + "".join(
        f"{point} {row}\n" for point, row in zip(ROWS, rows, strict=False)
    )
    _, attributes = read(tmp_path / "a.off", text + "3 0 1 2\n")
    assert [*attributes.vertex] == ["nx", "ny", "nz", "red", "green", "blue", "alpha", "s", "t"]
    assert attributes.vertex["green"].tolist() == [0, 255, 2]
    assert attributes.vertex["t"].tolist() == [0.5, 1, 1]
    undeclared = text.removeprefix("STCN") + "3 0 1 2 8\n"
    assert read(tmp_path / "b.off", undeclared)[1].left_out == (
        "numbers after the corners of faces", "numbers after the positions of vertices",
    )  # fmt: skip
