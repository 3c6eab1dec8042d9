"""Damaged files are read, or refused by a MeshError with one short line that names the path."""

from __future__ import annotations

import contextlib
import copy
import functools
import json
import random
import struct
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import damage
import mesh_files
import numpy as np
import shapes

import superfacets as sf
from superfacets.files.formats import FORMATS

from .promises import check_labels, refusals

Read = Callable[[Path], Any]

MAX_CELLS = 2000
"""Maximum number of cells that are segmented. Larger inputs are rare, and are only read."""

MAX_GROWING = 10_000
"""Maximum length of a JSON document in which a list is repeated 300 times.

A repeated list can contain lists that are repeated, so that an unlimited document would grow to
27 million times its length.
"""

_POINTS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n"
_NODES = "".join(f"{i} {line}\n" for i, line in enumerate(_POINTS.splitlines(), 1))

TETS = {
    "tets.mesh": "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n"
    + _POINTS.replace("\n", " 0\n") + "Tetrahedra\n2\n1 2 3 4 0\n2 3 4 5 1\nEnd\n",
    "old.msh": f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n{_NODES}$EndNodes\n$Elements\n2\n"
    "1 4 2 0 1 1 2 3 4\n2 4 2 0 1 2 3 4 5\n$EndElements\n",
    "new.msh": "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n"
    f"{_POINTS}$EndNodes\n$Elements\n1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2 2 3 4 5\n$EndElements\n",
    "text.vtk": "# vtk DataFile Version 2.0\ntets\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    f"POINTS 5 double\n{_POINTS}CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n",
}  # fmt: skip
"""Files of tetrahedra in formats that this package cannot write."""

ODD_VALUES = (
    None, True, -1, 0, 1, 2**31, 2**63, 10**400, 0.5, -1e308, "", "\ud800", "../a",
    "%2Fetc%2Fhosts", "data:;base64,AAAA", [], {}, [0, 0], [[]], {"POSITION": 0},
)  # fmt: skip


def check_file(rng: np.random.Generator, folder: Path, formats: tuple[str, ...] = ()) -> None:
    """Read a damaged file of a mesh, a cloud or labels, and segment the cells that were read."""
    source = random.Random(int(rng.integers(2**63)))
    read, name, data = source.choice(whole_files(formats))
    if name.endswith((".gltf", ".glb")) and source.random() < 0.5:
        data = _with_odd_document(name, source)
    path = folder / f"damaged{''.join(Path(name).suffixes)}"
    data = _damaged(data, source)
    if path.suffix == ".e57" and source.random() < 0.8:
        data = _with_checksums(data)
    with contextlib.suppress(OSError, sf.MissingExtraError):
        if damage.check(read, path, data) and read is not sf.read_labels:
            _check_cells(read(path))


def _check_cells(cells: Any) -> None:
    """Check that cells are either segmented, or refused with an error of this package."""
    if cells.n_cells <= MAX_CELLS:
        with refusals():
            result = sf.segment(cells, min(3, cells.n_cells))
            check_labels(result.labels, cells.n_cells, result.n_segments)


@functools.cache
def whole_files(formats: tuple[str, ...]) -> list[tuple[Read, str, bytes]]:
    """Return reader, name and content of small files, in all formats or in the given formats."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        files = [(sf.read_mesh, *item) for item in mesh_files.whole_files().items()]
        document = json.dumps(mesh_files.gltf_document()).encode()
        files.append((sf.read_mesh, "a.gltf", document))
        files += [(sf.read_labels, *item) for item in damage.whole_label_files(folder).items()]
        for path in _written_files(folder):
            for read, endings in (
                (sf.read_mesh, FORMATS.meshes), (sf.read_cloud, tuple(FORMATS["read_points"])),
                (sf.read_labels, FORMATS.labels),
            ):  # fmt: skip
                if path.name.endswith(tuple(endings)) and _can_read(read, path):
                    files.append((read, path.name, path.read_bytes()))
    return [file for file in files if not formats or Path(file[1]).suffix in formats]


def _can_read(read: Read, path: Path) -> bool:
    try:
        read(path)
    except (sf.MeshError, ValueError):
        return False
    return True


def _written_files(folder: Path) -> Iterator[Path]:
    """Write files with this package, with other libraries, and from the texts in `TETS`.

    Yields the paths of the files.
    """
    mesh = shapes.cube()
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
    tets = sf.TetMesh(corners, [[0, 1, 2, 3], [1, 2, 3, 4]])
    cloud = sf.PointCloud(corners, colors=corners)
    table = np.random.default_rng(0).random((40, 3))
    large = sf.PointCloud(table, colors=table)
    for cells, endings in (
        (mesh, (".vtp",)), (tets, (".vtu", ".vtk")),
        (cloud, (".ply", ".csv", ".pcd", ".las", ".laz")), (large, (".las", ".laz")),
    ):  # fmt: skip
        for ending in endings:
            path = folder / f"written-{cells.n_cells}{ending}"
            sf.write_mesh(path, cells, np.arange(cells.n_cells) % 2)
            yield path
    np.save(folder / "points.npy", corners)
    yield folder / "points.npy"
    for ending in (".xyz", ".txt"):
        np.savetxt(folder / f"points{ending}", corners)
        yield folder / f"points{ending}"
    for name, text in TETS.items():
        (folder / name).write_text(text)
        yield folder / name
    yield from _cortex_files(folder, mesh)
    yield from _las_files(folder)
    yield from _e57_files(folder)


def _cortex_files(folder: Path, mesh: sf.Mesh) -> Iterator[Path]:
    """Write surfaces, labels and values of vertices as GIFTI and FreeSurfer files."""
    for ending in (".label.gii", ".annot"):
        sf.write_labels(folder / f"lh{ending}", np.arange(mesh.n_vertices) // 2)
        yield folder / f"lh{ending}"
    text = (folder / "lh.label.gii").read_bytes()
    (folder / "lh.shape.gii").write_bytes(text.replace(b"INTENT_LABEL", b"INTENT_SHAPE"))
    yield folder / "lh.shape.gii"
    array = (
        '<DataArray Intent="NIFTI_INTENT_{}" DataType="NIFTI_TYPE_{}" Dimensionality="2" Dim0="{}"'
        ' Dim1="3" Encoding="ASCII"><Data>{}</Data></DataArray>'
    )
    points, faces = mesh.vertices.astype(">f4"), mesh.faces.astype(">i4")
    arrays = [
        array.format(intent, kind, len(rows), " ".join(map(str, rows.ravel().tolist())))
        for intent, kind, rows in (("POINTSET", "FLOAT32", points), ("TRIANGLE", "INT32", faces))
    ]
    (folder / "lh.gii").write_text(f"<GIFTI>{''.join(arrays)}</GIFTI>")
    yield folder / "lh.gii"
    sizes = np.array([len(points), len(faces)], ">i4").tobytes()
    head = b"\xff\xff\xfemade by a test\n\n" + sizes
    (folder / "lh.white").write_bytes(head + points.tobytes() + faces.tobytes())
    yield folder / "lh.white"
    curve = np.arange(len(points)).astype(">f4").tobytes()
    (folder / "lh.curv").write_bytes(b"\xff" * 3 + sizes + b"\0\0\0\1" + curve)
    yield folder / "lh.curv"


def _las_files(folder: Path) -> Iterator[Path]:
    """Write LAS and LAZ files in old and new point formats, with extra dimensions."""
    import laspy

    for point_format, ending in ((3, ".las"), (3, ".laz"), (8, ".las"), (8, ".laz"), (10, ".laz")):
        las = laspy.LasData(laspy.LasHeader(point_format=point_format, version="1.4"))
        las.x, las.y, las.z = np.random.default_rng(1).random((3, 30))
        las.add_extra_dim(laspy.ExtraBytesParams(name="label", type="i4"))
        las.add_extra_dim(laspy.ExtraBytesParams(name="two words", type="u8"))
        path = folder / f"las-{point_format}{ending}"
        las.write(str(path))
        yield path


def _e57_files(folder: Path) -> Iterator[Path]:
    """Write an E57 file of two scans with colors, one of them moved, if pye57 is installed."""
    try:
        import pye57
    except ModuleNotFoundError:
        return
    points = np.random.default_rng(2).random((12, 3))
    columns = {f"cartesian{axis}": points[:, place].copy() for place, axis in enumerate("XYZ")}
    columns |= {
        f"color{name}": np.arange(12, dtype=np.uint8) * 20 for name in ("Red", "Green", "Blue")
    }
    path = folder / "scans.e57"
    with pye57.E57(str(path), mode="w") as file:
        file.write_scan_raw(columns)
        file.write_scan_raw(columns, translation=np.ones(3), rotation=np.array([1.0, 0, 0, 0]))
    yield path


def _with_checksums(data: bytes) -> bytes:
    """Return an E57 file with the correct checksum of each page, which libE57 requires."""
    pages = [data[place : place + 1020] for place in range(0, len(data), 1024)]
    return b"".join(page + struct.pack(">I", _checksum(page)) for page in pages)


@functools.cache
def _checksum_table() -> tuple[int, ...]:
    """Return the table of CRC-32C, with one entry for each value of a byte."""
    table = []
    for byte in range(256):
        remainder = byte
        for _ in range(8):
            remainder = remainder >> 1 ^ (0x82F63B78 if remainder & 1 else 0)
        table.append(remainder)
    return tuple(table)


def _checksum(page: bytes) -> int:
    table, found = _checksum_table(), 0xFFFFFFFF
    for byte in page:
        found = found >> 8 ^ table[(found ^ byte) & 255]
    return found ^ 0xFFFFFFFF


def _with_odd_document(name: str, source: random.Random) -> bytes:
    """Return a glTF file with odd values in its JSON document."""
    document = json.dumps(odd_document(mesh_files.gltf_document(), source))
    if name.endswith(".gltf"):
        return document.encode()
    return mesh_files.glb(json.loads(document))


def odd_document(document: dict[str, Any], source: random.Random) -> dict[str, Any]:
    """Make one to three changes in a JSON document: a replaced value, or a repeated list."""
    for _ in range(source.choice((1, 1, 2, 3))):
        place: Any = document
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            key = source.choice(keys)
            if not isinstance(place[key], dict | list) or not place[key] or source.random() < 0.2:
                break
            place = place[key]
        if isinstance(place[key], list) and source.random() < 0.5:
            times = (2, 300) if len(json.dumps(document)) < MAX_GROWING else (2,)
            place[key] = place[key] * source.choice(times)
        else:
            place[key] = copy.deepcopy(source.choice(ODD_VALUES))
            if not document:
                return document
    return document


def _damaged(data: bytes, source: random.Random) -> bytes:
    """Change bytes, truncate the file, insert the start of another file, or change nothing."""
    kind = source.random()
    if kind < 0.03:
        return data
    if kind < 0.13:
        return data[: source.randrange(1, len(data) + 1)]
    if kind < 0.2:
        _, _, other = source.choice(whole_files(()))
        return other[: source.randrange(1, len(other))] + data[source.randrange(len(data)) :]
    return damage.damaged(data, source)
