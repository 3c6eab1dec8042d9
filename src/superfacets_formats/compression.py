"""Decode glTF buffers that are compressed by meshopt or Draco.

Sizes in Draco data are compared with the sizes declared in the glTF document before DracoPy
allocates memory.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, GltfScene, counted, import_extra, named_errors, shortened

_BYTES_PER_VERTEX, _BYTES_PER_FACE = 24, 12

_DRACO_HEADER = 11
"""Size in bytes of signature, version, geometry type, encoding method and flags."""
_HAS_METADATA = 0x80  # bit mask for the upper byte of the flags
_INTEGERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2"}  # NumPy type codes, keyed by Draco's number


def decode_meshopt(
    content: memoryview, n_rows: int, row_size: int, mode: str, filter: str
) -> memoryview:
    """Decode a buffer view of vertex attributes or indices that is compressed by meshopt."""
    library = import_extra("meshopt", "reading glTF that is compressed by meshopt", "compressed")
    if not n_rows:
        return memoryview(b"")
    try:
        rows = library.decode_gltf_buffer(content, n_rows, row_size, mode, filter)
    except Exception as error:  # the library raises exceptions of many classes
        raise MeshError(f"the meshopt data is damaged: {shortened(str(error))}") from None
    return np.ascontiguousarray(rows).view(np.uint8).reshape(-1).data


def unpack_draco(
    scene: GltfScene, primitive: dict[str, Any], packed: dict[str, Any], mesh: int
) -> None:
    """Decode a primitive that is stored only as Draco data, so that `scene.rows` can read it."""
    positions, where = scene.positions_of(primitive, mesh), f"meshes[{mesh}]"
    if "bufferView" in scene.item("accessors", positions):
        return
    view, ids = scene.whole(packed, "bufferView"), packed.get("attributes")
    if scene.unpacked.get(positions, (-1,))[0] == view:
        return
    if not isinstance(ids, dict) or "indices" not in primitive:
        raise MeshError(f"broken glTF: {where} has damaged Draco data")
    n_vertices = scene.whole(scene.item("accessors", positions), "count")
    n_faces = scene.whole(scene.item("accessors", primitive["indices"]), "count") // 3
    scene.take(_BYTES_PER_VERTEX * n_vertices + _BYTES_PER_FACE * n_faces, where)
    with named_errors(where):
        corners, found = decode_draco(bytes(scene.view(view)), n_faces, n_vertices)
        decoded: list[tuple[Any, Array | None]] = [(primitive["indices"], corners)]
        for name in ids:
            if name in primitive["attributes"] and name.startswith(("POSITION", "TEXCOORD")):
                decoded.append((primitive["attributes"][name], found.get(scene.whole(ids, name))))
        for index, rows in decoded:
            accessor = f"accessors[{index}]"
            dtype, width = scene.form(scene.item("accessors", index), accessor)
            is_wrong = rows is not corners and (rows is None or rows.dtype != dtype)
            if is_wrong or rows is None or rows.size != width * len(rows):
                raise MeshError(f"the Draco data has no rows of the type that {accessor} declares")
            if scene.unpacked.get(index, (view,))[0] != view:
                raise MeshError(f"{accessor} is used by two Draco meshes, which is not supported")
            scene.unpacked[index] = view, rows


def decode_draco(content: bytes, n_faces: int, n_vertices: int) -> tuple[Array, dict[int, Array]]:
    """Return corners, (3F,) uint32, and attributes, (V, n), keyed by id, of a Draco mesh."""
    library = import_extra("DracoPy", "reading glTF that is compressed by Draco", "compressed")
    _check_draco_size(content, n_faces, n_vertices)
    try:
        mesh = library.decode(content)
        found: dict[int, Array] = {}
        for each in mesh.attributes:  # DracoPy returns all positions as float32
            rows = np.asarray(each["data"])
            stored = rows.astype(_INTEGERS.get(each["data_type"], rows.dtype))
            found[each["unique_id"]] = stored if np.array_equal(stored, rows) else rows
        corners = np.asarray(mesh.faces, np.uint32).ravel()
    except Exception as error:  # the library raises exceptions of many classes
        raise MeshError(f"the Draco data is damaged: {shortened(str(error))}") from None
    if len(corners) != 3 * n_faces or any(len(rows) != n_vertices for rows in found.values()):
        raise MeshError("broken glTF: the sizes of the Draco data differ from the declared sizes")
    return corners, found


def _check_draco_size(content: bytes, n_faces: int, n_vertices: int) -> None:
    """Raise a MeshError if Draco's counts contradict the accessors, before memory is allocated."""
    if content[:5] != b"DRACO" or content[5:8] != b"\x02\x02\x01" or len(content) < _DRACO_HEADER:
        raise MeshError("the Draco data is damaged or does not have the version 2.2")
    try:
        place = _DRACO_HEADER
        if content[10] & _HAS_METADATA:
            place = _after_metadata(content, place)
        is_sequential = content[8] == 0
        one, place = _varint(content, place + (not is_sequential))  # skip the traversal type
        other, _ = _varint(content, place)
    except IndexError:
        raise MeshError("the Draco data is truncated") from None
    faces, vertices = (one, other) if is_sequential else (other, one)
    if faces != n_faces or vertices > n_vertices:
        raise MeshError(
            f"the Draco data has {counted(faces, 'face')} and {counted(vertices, 'vertex')}, but"
            f" the accessors declare {counted(n_faces, 'face')} and {counted(n_vertices, 'vertex')}"
        )


def _after_metadata(content: bytes, place: int) -> int:
    n_attributes, place = _varint(content, place)
    for _ in range(n_attributes):
        _, place = _varint(content, place)
        place = _after_elements(content, place)
    return _after_elements(content, place)


def _after_elements(content: bytes, place: int) -> int:
    """Return the offset after a metadata element, which has named values and nested elements."""
    n_left = 1
    while n_left:
        n_left -= 1
        n_values, place = _varint(content, place)
        for _ in range(n_values):
            size, place = _varint(content, place + 1 + content[place])
            place += size
        n_below, place = _varint(content, place)
        n_left += n_below
        if n_left:  # skip the name of the next element
            place += 1 + content[place]
    return place


def _varint(content: bytes, place: int) -> tuple[int, int]:
    """Decode an integer in groups of seven bits, lowest first; return it with the next offset."""
    value = 0
    for shift in range(0, 64, 7):
        byte = content[place]
        value |= (byte & 0x7F) << shift
        place += 1
        if byte < 0x80:
            break
    return value, place
