"""Tilesets of 3D Tiles 1.0 and 1.1: the models of the finest level, and where they lie."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from ..._types import Floats
from ...errors import MeshError
from ..guards import named_errors, read_content
from ..textures import file_beside
from .b3dm import UP_AXES, Placement, translation
from .gltf import product
from .gltf_file import items, numbers, parsed_json

USUAL_NAME = "tileset.json"

MAX_TILES = 1_000_000
"""Tiles that are looked at: files that include each other can stand for any number."""

FAR = 100_000.0
"""Distance of a tileset from zero from which positions are moved: there, neighbors of single
precision are 8 mm apart."""

_EQUATOR, _FLATNESS = 6378137.0, 6.69437999014e-3
"""Radius of the WGS84 ellipsoid in meters, and its squared eccentricity."""


class Tile(NamedTuple):
    """A model of a tileset."""

    path: Path
    name: str  # path below the folder of the tileset, with slashes
    placement: Placement


@dataclass(frozen=True)
class Tileset:
    """The models of a tileset, in its order."""

    tiles: tuple[Tile, ...]
    origin: tuple[float, ...]
    """What is subtracted from all positions: whole numbers, 0 if the tileset is near to zero."""


class _Visit(NamedTuple):
    """A tile that is to be looked at."""

    tile: dict[str, Any]
    file: Path  # that describes it
    above: Floats  # matrix of the tile above
    refine: str  # of the tile above
    up: str  # axis of models
    files: tuple[Path, ...]  # that include each other, down to this tile


def tileset_at(path: Path) -> Path | None:
    """The file of a tileset, if the path is one (.json) or a folder that has one; else None."""
    if path.suffix.lower() == ".json":
        return path
    inside = path / USUAL_NAME
    return inside if inside.is_file() else None


def read_tileset(path: Path) -> Tileset:
    """Return the models that a tileset shows at full detail; they are not read.

    The content of a tile whose `refine` is ``"REPLACE"`` is left out if the tile has children. All
    files must be in the folder of the tileset or below it.

    Raises
    ------
    MeshError
        If a file is damaged, includes itself, refers to a place outside of the folder, or uses
        implicit tiling; or if there is no model.
    OSError
        If a file of a tileset cannot be read.
    """
    walk = _Walk(path.parent)
    found = [*walk.models(path)]
    if not found:
        raise MeshError(f"{path}: the tileset shows no models")
    origin = walk.origin(path)
    away = translation(-origin)
    start = tuple(origin.tolist())
    tiles = []
    for file, name, matrix, up in found:
        moved = product(away, matrix)
        tiles.append(Tile(file, name, Placement(tuple(moved.ravel().tolist()), up, start)))
    return Tileset(tuple(tiles), start)


@dataclass
class _Walk:
    """Visits the tiles of a tileset, and of the tilesets that it includes."""

    folder: Path
    documents: dict[Path, dict[str, Any]] = field(default_factory=dict)

    def models(self, path: Path) -> Iterator[tuple[Path, str, Floats, str]]:
        """Path, name, matrix and upward axis of each model, depth first."""
        stack = [self._root(path, np.eye(4), "REPLACE", ())]
        n_visited = 0
        while stack:
            visit = stack.pop()
            n_visited += 1
            if n_visited > MAX_TILES:
                raise MeshError(f"{path}: the tileset has more than {MAX_TILES} tiles")
            with named_errors(visit.file):
                below, models = self._looked_at(visit)
            stack.extend(reversed(below))
            for file, name, matrix in models:
                yield file, name, matrix, visit.up

    def _looked_at(self, visit: _Visit) -> tuple[list[_Visit], list[tuple[Path, str, Floats]]]:
        """The tiles below a tile, and the models of its own that are shown."""
        tile, file = visit.tile, visit.file
        extensions = tile.get("extensions")
        named = extensions if isinstance(extensions, dict) else {}
        if "implicitTiling" in tile or "3DTILES_implicit_tiling" in named:
            raise MeshError("implicit tiling is not supported")
        matrix = product(visit.above, _transform(tile))
        refine = str(tile.get("refine", visit.refine)).upper()
        below = [
            visit._replace(tile=child, above=matrix, refine=refine)
            for child in items(tile, "children")
        ]
        models = []
        for content in _contents(tile, named.get("3DTILES_multiple_contents")):
            found, name = self._file_of(content, file)
            if found.suffix.lower() == ".json":
                below.append(self._root(found, matrix, refine, visit.files))
            else:
                models.append((found, name, matrix))
        is_replaced = bool(below) and refine != "ADD"
        return below, [] if is_replaced else models

    def _root(self, file: Path, above: Floats, refine: str, files: tuple[Path, ...]) -> _Visit:
        """The root of a tileset."""
        if file.resolve() in files:
            raise MeshError(f"the tileset {file.name} includes itself")
        if file not in self.documents:
            content = read_content(file)[:]
            with named_errors(file):
                self.documents[file] = _parsed(content)
        document = self.documents[file]
        up = str(document["asset"].get("gltfUpAxis", "Y")).upper()
        if up not in UP_AXES:
            raise MeshError(f"{file}: broken tileset: gltfUpAxis is {up[:20]!r}")
        return _Visit(document["root"], file, above, refine, up, (*files, file.resolve()))

    def _file_of(self, content: dict[str, Any], file: Path) -> tuple[Path, str]:
        """The file of a content, and its name below the folder."""
        address = content.get("uri", content.get("url"))
        if not isinstance(address, str):
            raise MeshError("broken tileset: a content has no uri")
        shown = repr(address if len(address) < 80 else f"{address[:77]}...")
        try:
            named = unquote(address.split("?")[0].split("#")[0], errors="strict")
            path = file_beside(named, file.parent, self.folder)
        except (OSError, ValueError):
            path = None
        if path is None:
            raise MeshError(f"the content {shown} is not in the folder of the tileset")
        return path, path.relative_to(self.folder.resolve()).as_posix()

    def origin(self, path: Path) -> Floats:
        """Center of the root's bounding volume in whole numbers; 0 if it is near to zero."""
        root = self.documents[path]["root"]
        matrix = _transform(root)
        center = matrix[:3, 3]
        volume = root.get("boundingVolume")
        shape = volume if isinstance(volume, dict) else {}
        with named_errors(path), np.errstate(over="ignore", invalid="ignore"):
            if "region" in shape:
                center = _center_of_region(numbers(shape, "region", [0.0] * 6))
            for name, size in (("box", 12), ("sphere", 4)):
                if name in shape:
                    given = numbers(shape, name, [0.0] * size)[:3]
                    center = product(matrix, translation(given))[:3, 3]
        if not np.isfinite(center).all():
            raise MeshError(f"{path}: the root of the tileset is infinitely far away")
        rounded: Floats = np.rint(center) + 0.0  # no negative zeros
        return rounded if np.abs(center).max() >= FAR else np.zeros(3)


def _parsed(content: bytes) -> dict[str, Any]:
    """The JSON of a tileset, which has an asset and a root."""
    document = parsed_json(content, "tileset")
    asset, root = document.get("asset"), document.get("root")
    if not isinstance(asset, dict) or not isinstance(root, dict):
        raise MeshError("not a tileset: the JSON has no asset and root")
    version = asset.get("version")
    if not isinstance(version, str) or not version.startswith(("0.", "1.")):
        raise MeshError("the version of the tileset is not supported, only 1.0 and 1.1 are")
    return document


def _transform(tile: dict[str, Any]) -> Floats:
    """The matrix of a tile, which is stored by columns."""
    return numbers(tile, "transform", np.eye(4).ravel().tolist()).reshape(4, 4).T


def _contents(tile: dict[str, Any], extension: object) -> list[dict[str, Any]]:
    """The contents of a tile: one, or several by 3D Tiles 1.1 or the extension of 1.0."""
    found = [tile["content"]] if isinstance(tile.get("content"), dict) else []
    found += items(tile, "contents")
    if isinstance(extension, dict):
        found += items(extension, "contents") + items(extension, "content")
    return found


def _center_of_region(region: Floats) -> Floats:
    """Center of west, south, east, north (radians) and heights, in the coordinates of the earth."""
    west, south, east, north, low, high = region.tolist()
    longitude, latitude, height = (west + east) / 2, (south + north) / 2, (low + high) / 2
    if west > east:  # across the date line
        longitude += np.pi
    normal = _EQUATOR / np.sqrt(1 - _FLATNESS * np.sin(latitude) ** 2)
    across = (normal + height) * np.cos(latitude)
    up = (normal * (1 - _FLATNESS) + height) * np.sin(latitude)
    return np.array([across * np.cos(longitude), across * np.sin(longitude), up])
