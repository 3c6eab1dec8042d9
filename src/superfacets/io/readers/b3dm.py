"""Extract the glTF model from a .b3dm file of 3D Tiles, and compute its placement."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..._types import Floats
from ..._validate import counted
from ...errors import MeshError
from ..guards import Content
from .gltf import product
from .gltf_file import numbers, parsed_json, whole

_HEADER = 28

_AXES = {
    "X": [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
    "Y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    "Z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
}
"""Rotations that turn the up axis of a model to z, the up axis of 3D Tiles."""

UP_AXES = tuple(_AXES)


class Placement(NamedTuple):
    """Position and orientation of a model in a tileset."""

    matrix: tuple[float, ...]  # 4 x 4 matrix, row by row, applied to tile coordinates with z up
    up: str  # up axis of the model: "X", "Y" or "Z"
    origin: tuple[float, ...]  # offset that `matrix` subtracts from all positions


@dataclass(frozen=True)
class Model:
    """A glTF file and its placement."""

    gltf: Content
    matrix: Floats | None = None  # applied to all positions of the scene; None for no change
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)  # offset that positions do not include

    @property
    def comments(self) -> tuple[str, ...]:
        """PLY comment with the origin; empty if the origin is 0."""
        text = " ".join(f"{number:.17g}" for number in self.origin)
        return (f"comment origin {text}",) if any(self.origin) else ()


def translation(vector: Floats) -> Floats:
    """Return the 4 x 4 matrix of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


def open_model(data: Content, placement: Placement | None) -> Model:
    """Return the glTF of a .b3dm, .glb or .gltf file, with its placement.

    If a .b3dm file is read without its tileset, its RTC_CENTER (an offset of all positions) becomes
    the origin.
    """
    is_tile = data[:4] == b"b3dm"
    gltf, center = _split_b3dm(data) if is_tile else (data, np.zeros(3))
    if placement is None and not is_tile:
        return Model(gltf)
    turn = np.eye(4)
    turn[:3, :3] = _AXES["Y" if placement is None else placement.up]
    if placement is None:
        return Model(gltf, turn, tuple(center.tolist()))
    place = product(np.array(placement.matrix).reshape(4, 4), translation(center))
    return Model(gltf, product(place, turn), placement.origin)


def _split_b3dm(data: Content) -> tuple[bytes, Floats]:
    """Return the GLB in a .b3dm file, and RTC_CENTER, the offset of its positions."""
    if len(data) < _HEADER:
        raise MeshError(f"the b3dm file is truncated: it has only {counted(len(data), 'byte')}")
    version, size, *sizes = struct.unpack_from("<6I", data, 4)
    begin = _HEADER + sum(sizes)
    if version != 1:
        raise MeshError(f"the b3dm version must be 1, got {version}")
    if size > len(data) or begin + 12 > size:
        raise MeshError("the b3dm file is shorter than its header declares: it may be truncated")
    if data[begin : begin + 4] != b"glTF":
        raise MeshError("the b3dm file contains no binary glTF")
    (glb_size,) = struct.unpack_from("<I", data, begin + 8)
    end = begin + glb_size if begin + glb_size <= size else size  # padding may follow the GLB
    return data[begin:end], _center_of(data[_HEADER:begin], *sizes[:2])


def _center_of(tables: bytes, json_size: int, binary_size: int) -> Floats:
    """Return RTC_CENTER from the JSON or binary part of a feature table, or 0 if it is missing."""
    text, binary = tables[:json_size], tables[json_size : json_size + binary_size]
    features = parsed_json(text, "b3dm") if text.strip() else {}
    center = features.get("RTC_CENTER", [0.0] * 3)
    if not isinstance(center, dict):
        return numbers(features, "RTC_CENTER", [0.0] * 3)
    begin = whole(center, "byteOffset")
    if begin + 12 > len(binary):
        raise MeshError("broken b3dm: the offset of RTC_CENTER is outside the feature table")
    found = np.frombuffer(binary, "<f4", 3, begin).astype(np.float64)
    if not np.isfinite(found).all():
        raise MeshError("broken b3dm: RTC_CENTER is not finite")
    return found
