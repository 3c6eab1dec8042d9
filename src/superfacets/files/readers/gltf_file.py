"""Read the JSON document of a glTF file, its buffers, and the arrays of its accessors.

Indices, sizes and strides in the document are compared with the sizes of the buffers before NumPy
uses them.
"""

from __future__ import annotations

import base64
import re
import reprlib
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self
from urllib.parse import unquote

import numpy as np

from ...base.checks import counted
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Floats
from ..guards import (
    MAX_GROWTH,
    Content,
    as_doubles,
    file_beside,
    most_bytes_of,
    named_errors,
    parsed_json,
    read_content,
)

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
"""Matches names of extensions that affect the geometry. If one is required, a file is refused."""


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
        names = [str(name) for name in required] if isinstance(required, list) else []
        used = [name for name in names if name not in SUPPORTED and GEOMETRY.search(name)]
        if used:
            raise MeshError(
                f"the glTF extension {used[0]} is not supported: save the file without it"
            )
        files: dict[Path, memoryview] = {}
        buffers = _read_buffers(document, binary, folder, files)
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
        if self.n_unpacked > most_bytes_of(self.n_bytes):
            raise MeshError(
                f"decompressed arrays, including {name}, have more than {MAX_GROWTH} times the size"
                " of the files: save the file uncompressed"
            )

    @staticmethod
    def items(item: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """Return the list of objects at `key`, or an empty list if the key is missing."""
        values = item.get(key, [])
        if not isinstance(values, list) or not all(isinstance(value, dict) for value in values):
            raise MeshError(f"broken glTF: {key} is not a list of objects")
        return values

    @staticmethod
    def extension(item: dict[str, Any], *names: str) -> dict[str, Any] | None:
        """Return the first of these extensions of an object that there is, or None."""
        extensions = item.get("extensions")
        named = extensions if isinstance(extensions, dict) else {}
        return next((named[name] for name in names if isinstance(named.get(name), dict)), None)

    @staticmethod
    def whole(item: dict[str, Any], key: str, default: int | None = None) -> int:
        """Return the integer >= 0 at `key`, or `default`; raise a MeshError for other values."""
        value = item.get(key, default)
        if type(value) is not int or value < 0:
            raise MeshError(
                f"broken glTF: {key} must be an integer >= 0, got {reprlib.repr(value)}"
            )
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
        accessor = self.item("accessors", index)
        where = f"accessors[{index}]"
        if accessor.get("type") != kind or self.whole(accessor, "componentType") not in COMPONENTS:
            raise MeshError(f"broken glTF: {where} must have the type {kind}")
        if type(index) is int and index in self.unpacked:
            return self.unpacked[index][1]
        if "sparse" in accessor or "bufferView" not in accessor:
            return self._sparse_rows(accessor, where, kind)
        return self._rows_at(accessor, accessor["componentType"], kind, where)

    def _sparse_rows(self, accessor: dict[str, Any], where: str, kind: str) -> Array:
        """Return rows of which some replace the rows of a buffer view, or else zeros."""
        n_rows, component = self.whole(accessor, "count"), accessor["componentType"]
        self.take(n_rows * WIDTHS[kind] * np.dtype(COMPONENTS[component]).itemsize, where)
        if "bufferView" in accessor:
            rows = self._rows_at(accessor, component, kind, where).copy()
        else:
            shape = (n_rows,) if kind == "SCALAR" else (n_rows, WIDTHS[kind])
            rows = np.zeros(shape, COMPONENTS[component])
        sparse = accessor.get("sparse", {"count": 0})
        if not isinstance(sparse, dict) or self.whole(sparse, "count") == 0:
            return rows
        places, values = sparse.get("indices"), sparse.get("values")
        if not isinstance(places, dict) or not isinstance(values, dict):
            raise MeshError(f"broken glTF: {where} has no indices or values of sparse rows")
        n_own = {"count": sparse["count"]}
        at = self._rows_at(places | n_own, places.get("componentType"), "SCALAR", where)
        if len(at) and at.max() >= n_rows:
            raise MeshError(f"broken glTF: {where} has a sparse row beyond its end")
        rows[at] = self._rows_at(values | n_own, component, kind, where)
        return rows

    def _rows_at(self, place: dict[str, Any], component: object, kind: str, where: str) -> Array:
        """Return `count` rows at a place in a buffer view."""
        if component not in COMPONENTS:
            raise MeshError(f"broken glTF: {where} has an unknown type of numbers")
        dtype = np.dtype(COMPONENTS[component])
        n_rows = self.whole(place, "count")
        view = self.item("bufferViews", place.get("bufferView"))
        content = self.view(place["bufferView"])
        begin = self.whole(place, "byteOffset", 0)
        row_size = dtype.itemsize * WIDTHS[kind]
        stride = self.whole(view, "byteStride", row_size)
        if stride < row_size:
            raise MeshError(f"broken glTF: the rows of {where} overlap")
        if n_rows and begin + stride * (n_rows - 1) + row_size > len(content):
            raise MeshError(
                f"broken glTF: {where} is longer than its buffer view: the file may be truncated"
            )
        shape = (n_rows,) if kind == "SCALAR" else (n_rows, WIDTHS[kind])
        strides = (stride,) if kind == "SCALAR" else (stride, dtype.itemsize)
        if not n_rows:
            return np.empty(shape, dtype=dtype)
        return np.ndarray(shape, dtype=dtype, buffer=content, offset=begin, strides=strides)

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
                raise MeshError(
                    f"broken glTF: bufferViews[{index}] has an unknown compression mode"
                )
            content = self._range(packed)
            with named_errors(f"bufferViews[{index}]"):
                unpack = load("superfacets_formats.compression:decode_meshopt")
                self.unpacked_views[index] = unpack(content, n_rows, row_size, mode, filter)
        return self.unpacked_views[index]

    def _range(self, view: dict[str, Any]) -> memoryview:
        self.item("buffers", view.get("buffer"))
        buffer = self.buffers[view["buffer"]]
        begin, size = self.whole(view, "byteOffset", 0), self.whole(view, "byteLength")
        if begin + size > len(buffer):
            raise MeshError(
                "broken glTF: a buffer view is longer than its buffer: the file may be truncated"
            )
        content: memoryview = buffer[begin : begin + size]
        return content


def _split_chunks(data: Content) -> tuple[bytes, memoryview]:
    if len(data) < 20:
        raise MeshError(f"the GLB file is truncated: it has only {counted(len(data), 'byte')}")
    version, size, json_size, kind = struct.unpack_from("<4I", data, 4)
    if version != 2:
        raise MeshError(f"the GLB version must be 2, got {version}")
    if size != len(data):
        raise MeshError(
            f"the GLB declares {counted(size, 'byte')} but has {len(data)}: it may be damaged"
        )
    json_end = 20 + json_size
    if kind != CHUNK_JSON or json_end > len(data):
        raise MeshError("broken GLB: the first chunk must be a complete JSON chunk")
    binary = memoryview(b"")
    if json_end < len(data):
        if json_end + 8 > len(data):
            raise MeshError("broken GLB: the header of the second chunk is truncated")
        binary_size, kind = struct.unpack_from("<2I", data, json_end)
        if json_end + 8 + binary_size > len(data):
            raise MeshError("broken GLB: the second chunk extends past the end of the file")
        if kind == CHUNK_BINARY:
            binary = memoryview(data)[json_end + 8 : json_end + 8 + binary_size]
    return data[20:json_end], binary


def _read_buffers(
    document: dict[str, Any], binary: memoryview, folder: Path | None, files: dict[Path, memoryview]
) -> list[memoryview]:
    """Return the bytes of each buffer; no bytes for the fallback of a buffer packed by meshopt."""
    contents: list[memoryview] = []
    for index, buffer in enumerate(Gltf.items(document, "buffers")):
        address = buffer.get("uri")
        if address is None and (Gltf.extension(buffer, *MESHOPT) or {}).get("fallback") is True:
            contents.append(memoryview(b""))
            continue
        if address is None and index == 0:
            content = binary
        elif isinstance(address, str):
            content = _fetch(address, folder, files)
        else:
            raise MeshError(f"broken glTF: buffers[{index}] must have a uri")
        declared = Gltf.whole(buffer, "byteLength")
        if declared > len(content):
            raise MeshError(
                f"buffers[{index}] declares {reprlib.repr(declared)} bytes but has {len(content)}:"
                " the file may be truncated"
            )
        contents.append(content)
    return contents


def _fetch(address: str, folder: Path | None, files: dict[Path, memoryview]) -> memoryview:
    """Read a data URI, or a file in the folder of the document; `files` caches files by path."""
    shown = reprlib.repr(address)
    if address.startswith("data:"):
        return memoryview(Gltf.decoded(address))
    try:
        path = file_beside(unquote(address, errors="strict"), folder)
        if path is None:
            raise MeshError(f"the buffer {shown} is not in the folder of the glTF file")
        if path not in files:
            files[path] = memoryview(read_content(path))
    except (OSError, UnicodeError):
        raise MeshError(f"the buffer file {shown} of the glTF file cannot be read") from None
    return files[path]
