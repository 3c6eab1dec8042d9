"""Read the JSON document of a glTF file, its buffers, and the arrays of its accessors.

Indices, sizes and strides in the document are compared with the sizes of the buffers before NumPy
uses them.
"""

from __future__ import annotations

import base64
import re
import reprlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self
from urllib.parse import unquote

import numpy as np

from ...base.arrays import as_doubles
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.text import parsed_json
from ...base.types import Array, Floats
from .. import guards
from ..guards import Content

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
"""Numbers per row for each accessor type."""

CHUNK_JSON, CHUNK_BINARY = 0x4E4F534A, 0x004E4942

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

SUPPORTED = (
    "EXT_mesh_gpu_instancing", "EXT_mesh_features", "EXT_structural_metadata", *MESHOPT,
    "KHR_draco_mesh_compression", "KHR_mesh_quantization",
)  # fmt: skip
"""Extensions that affect the geometry, and are read."""

GEOMETRY = re.compile(r"mesh|geometry|gaussian|node|visibility|primitive")
"""Matches names of extensions that affect the geometry. Files that require one are refused."""


@dataclass(eq=False)
class Gltf:
    """A parsed glTF document, its buffers, and its decompressed arrays."""

    document: dict[str, Any]  # parsed JSON
    buffers: list[memoryview]  # content of each buffer; empty if only compressed data exists
    n_bytes: int  # total size of the file and of the files that it refers to, in bytes
    unpacked_views: dict[int, memoryview] = field(default_factory=dict)
    """Decompressed buffer views, keyed by the index of the view."""
    unpacked: dict[int, tuple[int, Array]] = field(default_factory=dict)
    """Buffer view of the Draco data, and decoded rows, keyed by the index of the accessor."""
    n_unpacked: int = 0  # total size of decompressed views and rows, in bytes

    @classmethod
    def open(cls, data: Content, folder: Path | None) -> Self:
        """Parse a .glb or .gltf file, and read its buffers."""
        text, binary = _split_chunks(data) if data[:4] == b"glTF" else (data[:], memoryview(b""))
        document = parsed_json(text, "the glTF file")
        if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
            raise MeshError("not a glTF file: the JSON has no asset")
        version = document["asset"].get("version")
        if not isinstance(version, str) or not version.startswith("2."):
            raise MeshError(f"the glTF version must be 2.0, got {reprlib.repr(version)}")
        required = document.get("extensionsRequired", [])
        for name in map(str, required if isinstance(required, list) else []):
            if name not in SUPPORTED and GEOMETRY.search(name):
                raise MeshError(f"the glTF extension {name} is not supported: save without it")
        files: dict[Path, memoryview] = {}
        buffers = [
            _content_of(buffer, index, binary, folder, files)
            for index, buffer in enumerate(cls.items(document, "buffers"))
        ]
        return cls(document, buffers, len(data) + sum(map(len, files.values())))

    def item(self, kind: str, index: object) -> dict[str, Any]:
        """Return the object at `index` of the list `kind`; a missing object raises a MeshError."""
        listed = self.document.get(kind)
        found = listed if isinstance(listed, list) else []
        item = found[index] if type(index) is int and 0 <= index < len(found) else None
        if not isinstance(item, dict):
            raise MeshError(f"broken glTF: there is no {kind}[{reprlib.repr(index)}]")
        return item

    def take(self, n_bytes: int, name: str) -> None:
        """Count decompressed bytes, and raise a MeshError if their sum exceeds the limit."""
        self.n_unpacked += n_bytes
        self.check_growth(self.n_unpacked, name)

    def check_growth(self, n_bytes: int, name: str) -> None:
        """Raise a MeshError if `n_bytes` of arrays, the last named `name`, exceed the limit."""
        if n_bytes > guards.most_bytes_of(self.n_bytes):
            raise MeshError(
                f"the arrays, including {name}, have more than {guards.MAX_GROWTH} times the size"
                " of the files: save the file without compression or copies of meshes"
            )

    @staticmethod
    def items(item: dict[str, Any], key: str, kind: type = dict) -> list[Any]:
        """Return the list of objects of a class at `key`; an empty list if the key is missing."""
        values = item.get(key, [])
        if not isinstance(values, list) or not all(type(value) is kind for value in values):
            noun = "objects" if kind is dict else "indices"
            raise MeshError(f"broken glTF: {key} is not a list of {noun}")
        return values

    @staticmethod
    def extension(item: dict[str, Any], *names: str) -> dict[str, Any] | None:
        """Return the first of these extensions that an object has, or None."""
        extensions = item.get("extensions")
        named = extensions if isinstance(extensions, dict) else {}
        return next((named[name] for name in names if isinstance(named.get(name), dict)), None)

    @staticmethod
    def whole(item: dict[str, Any], key: str, default: int | None = None) -> int:
        """Return the integer >= 0 at `key`, or `default`; raise a MeshError for other values."""
        value = item.get(key, default)
        if type(value) is not int or value < 0:
            got = reprlib.repr(value)
            raise MeshError(f"broken glTF: {key} must be an integer >= 0, got {got}")
        return value

    @staticmethod
    def numbers(item: dict[str, Any], key: str, default: list[float]) -> Floats:
        """Return the list of numbers at `key`, or `default`, which has the same length."""
        values = item.get(key, default)
        is_list = isinstance(values, list) and len(values) == len(default)
        if not is_list or not all(type(value) in (int, float) for value in values):
            raise MeshError(f"broken glTF: {key} must be a list of {len(default)} numbers")
        return np.array(values, dtype=np.float64)

    @staticmethod
    def decoded(address: str) -> bytes:
        """Return the bytes of a data URI."""
        _, marker, encoded = address.partition(";base64,")
        try:
            return base64.b64decode(encoded if marker else "*", validate=True)
        except ValueError:
            raise MeshError(f"broken glTF: {reprlib.repr(address)} is not base64") from None

    def rows(self, index: object, kind: str) -> Array:
        """Return the array of an accessor of type `kind`, of shape (n,), (n, 2) or (n, 3)."""
        accessor, where = self.item("accessors", index), f"accessors[{index}]"
        dtype, width = self.form(accessor, where)
        if accessor["type"] != kind:
            raise MeshError(f"broken glTF: {where} must have the type {kind}")
        if type(index) is int and index in self.unpacked:
            return self.unpacked[index][1]
        sparse = accessor.get("sparse")
        if sparse is None and "bufferView" in accessor:
            return self._rows_at(accessor, where)
        n_rows = self.whole(accessor, "count")
        self.take(n_rows * width * dtype.itemsize, where)
        rows = np.zeros((n_rows,) if kind == "SCALAR" else (n_rows, width), dtype)
        if "bufferView" in accessor:
            rows = self._rows_at(accessor, where).copy()
        if isinstance(sparse, dict) and self.whole(sparse, "count"):
            places, values = sparse.get("indices"), sparse.get("values")
            if not isinstance(places, dict) or not isinstance(values, dict):
                raise MeshError(f"broken glTF: {where} has no indices or values of sparse rows")
            form = {name: accessor[name] for name in ("componentType", "type")}
            form["count"] = sparse["count"]
            at = self._rows_at(form | places | {"count": form["count"], "type": "SCALAR"}, where)
            if len(at) and (at.dtype.kind != "u" or at.max() >= n_rows):
                raise MeshError(f"broken glTF: {where} has a sparse index beyond its end")
            rows[at] = self._rows_at(values | form, where)
        return rows

    @classmethod
    def form(cls, accessor: dict[str, Any], where: str) -> tuple[np.dtype[Any], int]:
        """Return the type of the numbers of an accessor, and how many there are per row."""
        component, kind = cls.whole(accessor, "componentType"), str(accessor.get("type"))
        if component not in COMPONENTS or kind not in WIDTHS:
            raise MeshError(f"broken glTF: {where} has an unknown type of numbers")
        return np.dtype(COMPONENTS[component]), WIDTHS[kind]

    def _rows_at(self, accessor: dict[str, Any], where: str) -> Array:
        """Return the rows of an accessor in its buffer view."""
        dtype, width = self.form(accessor, where)
        n_rows, row_size = self.whole(accessor, "count"), dtype.itemsize * width
        view = self.item("bufferViews", accessor.get("bufferView"))
        content = self.view(accessor["bufferView"])
        begin = self.whole(accessor, "byteOffset", 0)
        stride = self.whole(view, "byteStride", row_size)
        if stride < row_size:
            raise MeshError(f"broken glTF: the rows of {where} overlap")
        if n_rows and begin + stride * (n_rows - 1) + row_size > len(content):
            raise MeshError(
                f"broken glTF: {where} is longer than its buffer view: the file may be truncated"
            )
        strides = (stride, dtype.itemsize)
        rows = np.ndarray((n_rows, width), dtype, content, begin if n_rows else 0, strides)
        return rows[:, 0] if accessor["type"] == "SCALAR" else rows

    def doubles(self, index: object, kind: str) -> Floats:
        """Return the same as `rows`, as float64; normalized integers become 0 to 1 or -1 to 1."""
        stored = self.rows(index, kind)
        values = as_doubles(stored)
        if stored.dtype.kind == "f" or self.item("accessors", index).get("normalized") is not True:
            return values
        return np.maximum(values / np.iinfo(stored.dtype).max, -1.0)

    def view(self, index: int) -> memoryview:
        """Return the bytes of a buffer view; decompress it if there is no uncompressed copy."""
        view = self.item("bufferViews", index)
        packed = self.extension(view, *MESHOPT)
        self.item("buffers", view.get("buffer"))
        if packed is None or len(self.buffers[view["buffer"]]):
            return self._range(view)
        if index not in self.unpacked_views:
            n_rows, row_size = self.whole(packed, "count"), self.whole(packed, "byteStride")
            self.take(n_rows * row_size, f"bufferViews[{index}]")
            mode, filter = packed.get("mode"), packed.get("filter", "NONE")
            if not isinstance(mode, str) or not isinstance(filter, str):
                raise MeshError(f"broken glTF: bufferViews[{index}] has an unknown compression")
            content = self._range(packed)
            with guards.named_errors(f"bufferViews[{index}]"):
                unpack = load("superfacets_formats.compression:decode_meshopt")
                self.unpacked_views[index] = unpack(content, n_rows, row_size, mode, filter)
        return self.unpacked_views[index]

    def _range(self, view: dict[str, Any]) -> memoryview:
        owner = self.item("buffers", view.get("buffer"))
        buffer = self.buffers[view["buffer"]]
        begin, size = self.whole(view, "byteOffset", 0), self.whole(view, "byteLength")
        if begin + size > len(buffer):
            why = "a buffer view is longer than its buffer: the file may be truncated"
            missing = f"buffers[{view['buffer']}] must have a uri"
            raise MeshError(f"broken glTF: {why if 'uri' in owner or len(buffer) else missing}")
        content: memoryview = buffer[begin : begin + size]
        return content


def _split_chunks(data: Content) -> tuple[bytes, memoryview]:
    """Return the JSON text of a GLB file, and its binary chunk, which may be missing."""
    reader, chunks = guards.BinaryReader(data, begin=4), dict[int, memoryview]()
    version, size = reader.take("2I")
    if version != 2:
        raise MeshError(f"the GLB version must be 2, got {version}")
    if size != len(data):
        raise MeshError(f"the GLB declares {size} bytes but has {len(data)}: it may be damaged")
    while reader.at < size and len(chunks) < 2:
        chunk_size, kind = reader.take("2I")
        reader.skip(chunk_size)
        chunks[kind] = memoryview(data)[reader.at - chunk_size : reader.at]
    if CHUNK_JSON not in chunks:
        raise MeshError("broken GLB: there is no JSON chunk")
    return bytes(chunks[CHUNK_JSON]), chunks.get(CHUNK_BINARY, memoryview(b""))


def _content_of(
    buffer: dict[str, Any], index: int, binary: memoryview, folder: Path | None,
    files: dict[Path, memoryview],
) -> memoryview:  # fmt: skip
    """Return the bytes of a buffer, from a data URI, the binary chunk, or the cache `files`.

    The fallback of a buffer packed by meshopt has no bytes; some writers do not mark it.
    """
    address, shown = buffer.get("uri"), reprlib.repr(buffer.get("uri"))
    if address is None and (index > 0 or Gltf.extension(buffer, *MESHOPT)):
        return memoryview(b"")
    if not isinstance(address, str) and address is not None:
        raise MeshError(f"broken glTF: buffers[{index}] must have a uri")
    if address is None:
        content = binary
    elif address.startswith("data:"):
        content = memoryview(Gltf.decoded(address))
    else:
        try:
            path = guards.file_beside(unquote(address, errors="strict"), folder)
            if path is None:
                raise MeshError(f"the buffer {shown} is not in the folder of the glTF file")
            if path not in files:
                files[path] = memoryview(guards.read_content(path))
        except (OSError, UnicodeError):
            raise MeshError(f"the buffer file {shown} of the glTF file cannot be read") from None
        content = files[path]
    declared = Gltf.whole(buffer, "byteLength")
    if declared > len(content):
        raise MeshError(
            f"buffers[{index}] declares {reprlib.repr(declared)} bytes but has {len(content)}:"
            " the file may be truncated"
        )
    return content
