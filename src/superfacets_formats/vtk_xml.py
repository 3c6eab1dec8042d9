"""Read VTP and VTU files: VTK XML with inline or appended arrays."""

from __future__ import annotations

import binascii
import lzma
import zlib
from collections.abc import Iterator, Sequence
from typing import Any, Literal
from xml.etree.ElementTree import Element, ParseError, fromstring

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Content, Input, Lines, Read, counted, shown

from .foreign import NO_ROWS
from .grids import Grid, as_count, sizes_between

NUMBER_TYPES = {
    **{f"Int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"UInt{8 * n}": f"u{n}" for n in (1, 2, 4, 8)}, "Float32": "f4", "Float64": "f8",
}  # fmt: skip
"""NumPy type codes, keyed by VTK type names."""

_NONE = np.empty(0, np.uint8)
"""Empty array; arrays of integers that are concatenated with it remain integers."""

_UNNAMED = "without a name"

_ORDERS: dict[str, Literal["<", ">"]] = {"LittleEndian": "<", "BigEndian": ">"}


def is_vtp(data: Content) -> bool:
    """Return whether the file is a VTK XML file of surfaces."""
    return all(word in data[:1000] for word in (b"<VTKFile", b"PolyData"))


def read_vtp(source: Input) -> Read:
    """Read the polygons of a VTP file, with the data of points and polygons."""
    if not is_vtp(source.data):
        raise MeshError("not a VTP file: it does not begin with a VTKFile of type PolyData")
    file = XmlFile(source.data, "PolyData")
    if file.needs_vtk or any(_count(piece, "NumberOfStrips") for piece in file.pieces):
        return Grid.of_foreign("read_with_vtk", source).read(source)
    points, sizes, corners = file.cells("Polys", "NumberOfPolys")
    file.declare_others(source)
    others = ("NumberOfVerts", "NumberOfLines")
    for name in others:
        if n := sum(_count(piece, name) for piece in file.pieces):
            source.declare(f"{counted(n, 'cell')} in {name[8:]}", "which has no polygons")
    return source.polygons(
        points, sizes, corners, vertex=file.data("PointData", "NumberOfPoints"),
        face=file.data("CellData", "NumberOfPolys", others),
    )  # fmt: skip


def read_vtu(source: Input) -> Read:
    """Read a VTU file, by VTK if it is compressed with LZ4."""
    file = XmlFile(source.data, "UnstructuredGrid")
    if file.needs_vtk:
        return Grid.of_foreign("read_with_vtk", source).read(source)
    file.declare_others(source)
    if not file.pieces:
        raise MeshError("the VTU file has no element Piece")
    points, sizes, corners = file.cells("Cells", "NumberOfCells")
    point = file.data("PointData", "NumberOfPoints")
    cell = file.data("CellData", "NumberOfCells")
    return Grid(points, file.kinds(), sizes, corners, point, cell).read(source)


def _count(piece: Element, name: str) -> int:
    """Return a count in the attributes of a Piece element; 0 if it is missing."""
    return as_count(piece.get(name, "0"), name)


def _array_in(piece: Element, section: str, name: str) -> Element | None:
    """Return the first array of this name, or None."""
    arrays = piece.findall(f"{section}/DataArray")
    return next((one for one in arrays if one.get("Name", _UNNAMED) == name), None)


class XmlFile:
    """A VTK XML file of one type, whose arrays are decoded on demand."""

    def __init__(self, data: Content, kind: str) -> None:
        self._left = kit.most_bytes_of(len(data))
        self._appended = memoryview(b"")
        begin = data.find(b"<AppendedData")
        text = data[:]
        if begin >= 0:
            tag_end = data.find(b">", begin) + 1
            body, end = data.find(b"_", tag_end), data.rfind(b"</AppendedData")
            if not 0 < tag_end <= body < end:
                raise MeshError("the appended data has no end: the file may be truncated")
            text = data[:tag_end] + data[end:]
            self._appended = memoryview(data[body + 1 : end])
        if b"<!DOCTYPE" in text:  # it can define entities
            raise MeshError("the XML must not have a DOCTYPE, which VTK files never have")
        root = parsed_xml(text, "VTKFile")
        if root.get("type") != kind or root.find(kind) is None:
            raise MeshError(f"expected a VTKFile of type {kind}, got {root.get('type')!s:.40}")
        for texts in root.iterfind(".//DataArray[@type='String']"):
            texts.tag = "Array"  # as newer versions of VTK write texts
        self._root = root
        self.pieces = root.findall(f"{kind}/Piece")
        self._order = _ORDERS.get(root.get("byte_order", ""))
        self._header = np.dtype(NUMBER_TYPES.get(root.get("header_type", "UInt32"), "u4"))
        self._compressor = root.get("compressor", "")
        appended = root.find("AppendedData")
        self._encoding = "" if appended is None else appended.get("encoding", "")

    @property
    def needs_vtk(self) -> bool:
        """Whether only VTK can decompress the arrays."""
        return self._compressor == "vtkLZ4DataCompressor"

    def declare_others(self, source: Input) -> None:
        """Declare texts, and data that belong to neither points nor cells."""
        for section in ("PointData", "CellData"):
            for array in self._root.iterfind(f".//{section}/Array"):
                source.declare(f"texts {array.get('Name', _UNNAMED)} of {section}")
        for array in self._root.iterfind(".//FieldData/*"):
            source.declare(f"field {array.get('Name', _UNNAMED)}", NO_ROWS)

    def cells(self, section: str, count: str) -> tuple[Array, Array, Array]:
        """Return vertices, (V, 3), sizes of cells, and flat corners of cells, of all pieces."""
        parts: list[tuple[Array, Array, Array]] = [(np.empty((0, 3)), _NONE, _NONE)]
        n_points = 0
        for piece in self.pieces:
            points = self._points(piece)
            ends = self._integers(piece, section, "offsets", _count(piece, count))
            sizes = sizes_between(ends, section)
            corners = self._integers(piece, section, "connectivity", int(sizes.sum()))
            parts.append((points, sizes, corners + n_points if n_points else corners))
            n_points += len(points)
        points, sizes, corners = map(np.concatenate, zip(*parts, strict=True))
        return points, sizes, corners

    def kinds(self) -> Array:
        """Return the VTK type of each cell of all pieces."""
        found = [
            self._integers(piece, "Cells", "types", _count(piece, "NumberOfCells"))
            for piece in self.pieces
        ]
        return np.concatenate([_NONE, *found])

    def data(
        self, section: str, count: str, before: Sequence[str] = ()
    ) -> Iterator[tuple[str, Array | str]]:
        """Yield the arrays of a section, PointData or CellData, for the rows of one kind.

        `count` and `before` are attributes of the XML element Piece: the number of these rows, and
        the numbers of the rows of other kinds that precede them.
        """
        found = [one for piece in self.pieces for one in piece.findall(f"{section}/DataArray")]
        for name in dict.fromkeys(one.get("Name", _UNNAMED) for one in found):
            parts = [self._rows(piece, section, name, count, before) for piece in self.pieces]
            whole = [part for part in parts if part is not None]
            widths = {part.shape[1:] for part in whole if len(part)}
            if len(whole) < len(parts) or len(widths) > 1:
                yield name, "which not all pieces of the file have"
            else:
                yield name, np.concatenate([part for part in whole if len(part)] or whole)

    def _rows(
        self, piece: Element, section: str, name: str, count: str, before: Sequence[str]
    ) -> Array | None:
        """Return an array of one piece, (n,) or (n, m), or None if it is missing."""
        n_before = sum(_count(piece, name) for name in before)
        n_rows = n_before + _count(piece, count)
        array = _array_in(piece, section, name)
        if not n_rows or array is None:
            return None if n_rows else _NONE
        width = max(as_count(array.get("NumberOfComponents", "1"), "NumberOfComponents"), 1)
        values = self._values(array, n_rows * width)
        return values[n_before:] if width == 1 else values.reshape(-1, width)[n_before:]

    def _points(self, piece: Element) -> Array:
        n_points = _count(piece, "NumberOfPoints")
        array = piece.find("Points/DataArray")
        if not n_points:
            return np.empty((0, 3))
        if array is None or array.get("NumberOfComponents") != "3":
            raise MeshError("the Points of the file must have 3 components")
        with np.errstate(invalid="ignore"):  # signaling NaNs
            return self._values(array, 3 * n_points).astype(np.float64, copy=False).reshape(-1, 3)

    def _integers(self, piece: Element, section: str, name: str, n: int) -> Array:
        """Return the named array of `n` integers, or raise a MeshError if it is missing."""
        if not n:
            return _NONE
        array = _array_in(piece, section, name)
        if array is None:
            raise MeshError(f"the file has no array {name} in {section}")
        if array.get("NumberOfComponents", "1") not in ("0", "1"):
            raise MeshError(f"the array {shown(name)} must have one number per cell")
        found = self._values(array, n)
        if found.dtype.kind not in "iu":
            raise MeshError(f"the array {name} must have an integer type, got {found.dtype}")
        return found

    def _values(self, array: Element, n: int) -> Array:
        """Return the `n` numbers of an array, or raise a MeshError if it has another size."""
        with kit.named_errors(f"the array {shown(array.get('Name', _UNNAMED))}"):
            self._left -= 8 * n
            if self._left < 0:
                raise MeshError(f"it declares {counted(n, 'number')}, too many for the file size")
            return self._decoded(array, n)

    def _decoded(self, array: Element, n: int) -> Array:
        word = array.get("type", "")
        if word not in NUMBER_TYPES:
            raise MeshError(f"expected a type such as Float64, got {shown(word)}")
        stored = np.dtype(NUMBER_TYPES[word])
        form = array.get("format", "ascii")
        if form == "ascii":
            values = parsed_numbers((array.text or "").encode(), stored)
            _check_size(len(values), n, "number")
            return values
        if form == "binary":
            data: Any = "".join((array.text or "").split()).encode()
            is_base64 = True
        elif form == "appended":
            offset = as_count(array.get("offset", ""), "offsets of appended data")
            data = self._appended[offset:]
            is_base64 = self._encoding != "raw"
        else:
            raise MeshError(f"expected the format ascii, binary or appended, got {shown(form)}")
        if self._order is None:
            raise MeshError("the byte_order of the VTKFile must be LittleEndian or BigEndian")
        content = self._content(data, is_base64, n * stored.itemsize)
        return np.frombuffer(content, stored.newbyteorder(self._order)).astype(stored)

    def _content(self, data: Any, is_base64: bool, n_bytes: int) -> bytes | bytearray:
        """Return the decompressed bytes of an array, which must be `n_bytes` bytes."""
        assert self._order is not None
        header, size = self._header.newbyteorder(self._order), self._header.itemsize
        first = int(np.frombuffer(_first_bytes(data, size, is_base64), header)[0])
        if not self._compressor:
            _check_size(first, n_bytes)
            return _first_bytes(data, size + first, is_base64)[size:]
        if not first:
            _check_size(0, n_bytes)
            return b""
        head = size * (3 + first)  # the header is encoded separately from the blocks
        sizes = np.frombuffer(_first_bytes(data, head, is_base64), header)[1:].tolist()
        full, last, packed = sizes[0], sizes[1] or sizes[0], sizes[2:]
        _check_size(full * (first - 1) + last, n_bytes)
        rest = data[_stored_size(head, is_base64) :]
        blocks = memoryview(_first_bytes(rest, sum(packed), is_base64))
        content = bytearray()
        for place, n_packed in enumerate(packed):
            block, blocks = blocks[:n_packed], blocks[n_packed:]
            content += self._unpacked(block, last if place == first - 1 else full)
        return content

    def _unpacked(self, block: memoryview, size: int) -> bytes:
        try:
            if self._compressor == "vtkZLibDataCompressor":
                content = zlib.decompressobj().decompress(block, size + 1)
            elif self._compressor == "vtkLZMADataCompressor":
                content = lzma.LZMADecompressor(memlimit=1 << 28).decompress(block, size + 1)
            else:
                raise MeshError(
                    f"the compressor {shown(self._compressor)} is not supported:"
                    " save the file with vtkZLibDataCompressor"
                )
        except (zlib.error, lzma.LZMAError, EOFError):
            raise MeshError("a compressed block is damaged") from None
        _check_size(len(content), size)
        return content


def _stored_size(n: int, is_base64: bool) -> int:
    return 4 * -(-n // 3) if is_base64 else n


def _first_bytes(data: bytes | memoryview, n: int, is_base64: bool) -> bytes:
    """Return the first `n` bytes; the size is checked before memory is allocated."""
    size = _stored_size(n, is_base64)
    _check_size(min(size, len(data)), size)
    if not is_base64:
        return bytes(data[:n])
    try:  # the last group of 4 characters may encode more than `n` bytes
        found = binascii.a2b_base64(data[:size], strict_mode=True)[:n]
    except binascii.Error:
        found = b""
    if len(found) < n:
        raise MeshError("the data is not valid base64: the file may be damaged")
    return found


def parsed_xml(text: bytes, tag: str) -> Element:
    """Return the root element of XML, which must have the given tag."""
    try:
        root = fromstring(text)
    except (ParseError, LookupError, ValueError) as error:  # LookupError: unknown encoding
        raise MeshError(f"the XML is truncated or damaged: {error}") from None
    if root.tag != tag:
        raise MeshError(f"expected XML of the type {tag}, got {shown(root.tag)}")
    return root


def parsed_numbers(text: bytes, stored: np.dtype[Any]) -> Array:
    """Parse all numbers in a text as type `stored`, unless this type cannot store an integer."""
    lines = Lines.of(text)
    if stored.kind != "f":
        found = kit.as_integers(lines.parse_integers_or_floats(), "values")
        return converted if np.array_equal(converted := found.astype(stored), found) else found
    with np.errstate(over="ignore", invalid="ignore"):
        return lines.parse(np.float64).astype(stored)


def _check_size(found: int, n: int, what: str = "byte") -> None:
    if found != n:
        raise MeshError(f"expected {counted(n, what)}, got {found}: the file may be damaged")
