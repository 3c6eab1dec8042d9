"""Small files of the same bent square in every format, built byte by byte."""

import json
import struct

import numpy as np

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5], [9, 9, 9]], dtype=np.float64)
"""Vertices of the square; no face uses the last vertex."""

FACES = np.array([[0, 1, 2], [0, 2, 3]])

CORNERS = VERTICES[FACES].reshape(-1, 3)
"""Vertices in formats that store three vertices per face."""

SOUP_FACES = np.arange(6).reshape(2, 3)

ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}


def text_of(rows) -> str:
    return "".join(" ".join(str(value) for value in row) + "\n" for row in rows)


def ply_header(form="ascii", *, n_vertices=5, n_faces=2, kind="float", faces=None) -> str:
    properties = "".join(f"property {kind} {axis}\n" for axis in "xyz")
    faces = faces or "property list uchar int vertex_indices\n"
    return (
        f"ply\nformat {form} 1.0\ncomment of nobody\nelement vertex {n_vertices}\n{properties}"
        f"element face {n_faces}\n{faces}end_header\n"
    )


def ply_text(vertices=VERTICES, faces=FACES, **header) -> bytes:
    header = {"n_vertices": len(vertices), "n_faces": len(faces), **header}
    rows = [[len(face), *face] for face in faces]
    return (ply_header(**header) + text_of(vertices) + text_of(rows)).encode()


def ply_binary(form="binary_little_endian", vertices=VERTICES, faces=FACES, **header) -> bytes:
    header = {"n_vertices": len(vertices), "n_faces": len(faces), **header}
    order = ORDERS[form]
    letter = {"float": "f", "double": "d"}[header.get("kind", "float")]
    body = b"".join(struct.pack(f"{order}3{letter}", *vertex) for vertex in vertices)
    body += b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces)
    return ply_header(form, **header).encode() + body


def obj(vertices=VERTICES, faces=FACES) -> bytes:
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(index + 1) for index in face) for face in faces]
    return ("\n".join(lines) + "\n").encode()


def off(vertices=VERTICES, faces=FACES) -> bytes:
    rows = [[len(face), *face] for face in faces]
    return (f"OFF\n{len(vertices)} {len(faces)} 0\n" + text_of(vertices) + text_of(rows)).encode()


def stl_binary(corners=CORNERS, *, head=b"made by a test", n_faces=None) -> bytes:
    triangles = np.reshape(corners, (-1, 9))
    data = head.ljust(80, b" ") + struct.pack("<I", len(triangles) if n_faces is None else n_faces)
    return data + b"".join(struct.pack("<12fH", 0, 0, 1, *nine, 7) for nine in triangles)


def stl_text(corners=CORNERS, name="square") -> bytes:
    text = f"solid {name}\n"
    for triangle in np.reshape(corners, (-1, 3, 3)).tolist():
        vertices = "".join(f"      vertex {x} {y} {z}\n" for x, y, z in triangle)
        text += f"  facet normal 0 0 1\n    outer loop\n{vertices}    endloop\n  endfacet\n"
    return (text + f"endsolid {name}\n").encode()


def gltf_buffer(vertices=VERTICES, faces=FACES) -> bytes:
    return np.asarray(vertices, "<f4").tobytes() + np.asarray(faces, "<u2").tobytes()


def gltf_document(nodes=None, **changes) -> dict:
    """Return a document with one mesh of one primitive; `changes` replace lists of the document."""
    nodes = nodes or [{"mesh": 0}]
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 60},
            {"buffer": 0, "byteOffset": 60, "byteLength": 12},
        ],
        "buffers": [{"byteLength": 72}],
        **changes,
    }


def glb(document=None, buffer=None) -> bytes:
    text = json.dumps(document or gltf_document()).encode()
    text += b" " * (-len(text) % 4)
    buffer = gltf_buffer() if buffer is None else buffer
    buffer += b"\0" * (-len(buffer) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<2I", len(buffer), 0x004E4942) + buffer
    return struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks


def draco_glb(vertices=VERTICES, faces=FACES, pairs=None, **options) -> bytes:
    """Return a GLB compressed by Draco, with texture coordinates if `pairs` are given."""
    import DracoPy

    given = {"quantization_bits": 14, "preserve_order": True, **options}
    data = DracoPy.encode(
        np.asarray(vertices, np.float32), faces=np.asarray(faces, np.uint32), tex_coord=pairs,
        **given,
    )  # fmt: skip
    mesh = DracoPy.decode(data)
    ids = {{0: "POSITION", 3: "TEXCOORD_0"}[each["attribute_type"]]: each["unique_id"]
           for each in mesh.attributes}  # fmt: skip
    n_vertices, n_faces = len(mesh.points), len(mesh.faces)
    primitive = {
        "attributes": {name: 1 + i for i, name in enumerate(ids)},
        "indices": 0,
        "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": ids}},
    }
    widths = {"POSITION": "VEC3", "TEXCOORD_0": "VEC2"}
    document = gltf_document(
        extensionsRequired=["KHR_draco_mesh_compression"],
        meshes=[{"primitives": [primitive]}],
        accessors=[
            {"componentType": 5125, "count": 3 * n_faces, "type": "SCALAR"},
            *({"componentType": 5126, "count": n_vertices, "type": widths[name]} for name in ids),
        ],
        bufferViews=[{"buffer": 0, "byteLength": len(data)}],
        buffers=[{"byteLength": len(data)}],
    )
    return glb(document, data)


def meshopt_glb(vertices=VERTICES, faces=FACES, pairs=None, name="EXT_meshopt_compression",
                filter="NONE") -> bytes:  # fmt: skip
    """Return a GLB compressed by meshopt; `pairs` become normalized 16-bit integers."""
    import meshopt

    positions = np.asarray(vertices, np.float32)
    if filter == "EXPONENTIAL":
        positions = meshopt.encode_filter_exp(positions, 24).view(np.float32)
    arrays = [(positions, 5126, "VEC3"), (np.asarray(faces, np.uint32).ravel(), 5125, "SCALAR")]
    if pairs is not None:
        arrays.append((np.rint(np.asarray(pairs) * 65535).astype(np.uint16), 5123, "VEC2"))
    data, views, accessors = b"", [], []
    for rows, code, kind in arrays:
        mode = "TRIANGLES" if kind == "SCALAR" else "ATTRIBUTES"
        packed = meshopt.encode_gltf_buffer(rows, mode)
        size = rows.nbytes // len(rows)
        place = {"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)}
        how = {"count": len(rows), "byteStride": size, "mode": mode}
        if kind == "VEC3":
            how["filter"] = filter
        views.append({"buffer": 1, "byteLength": rows.nbytes, "extensions": {name: place | how}})
        accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(rows),
                          "type": kind, "normalized": code == 5123})  # fmt: skip
        data += packed + b"\0" * (-len(packed) % 4)
    attributes = {"POSITION": 0} | ({} if pairs is None else {"TEXCOORD_0": 2})
    size = sum(view["byteLength"] for view in views)
    document = gltf_document(
        extensionsRequired=[name],
        meshes=[{"primitives": [{"attributes": attributes, "indices": 1}]}],
        accessors=accessors,
        bufferViews=views,
        buffers=[
            {"byteLength": len(data)},
            {"byteLength": size, "extensions": {name: {"fallback": True}}},
        ],
    )
    return glb(document, data)


def whole_files() -> dict[str, bytes]:
    """Return a file of each format, keyed by file name."""
    return {
        "ascii.ply": ply_text(), "little.ply": ply_binary(),
        "big.ply": ply_binary("binary_big_endian", kind="double"), "square.obj": obj(),
        "square.off": off(), "binary.stl": stl_binary(),
        "ascii.stl": stl_text(), "square.glb": glb(), "draco.glb": draco_glb(),
        "meshopt.glb": meshopt_glb(),
    }  # fmt: skip
