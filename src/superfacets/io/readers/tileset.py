"""Read tilesets of 3D Tiles 1.0 and 1.1: the models of the finest level, and their placements."""

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
from ..images import file_beside
from .b3dm import UP_AXES, Placement, translation
from .gltf import product
from .gltf_file import items, numbers, parsed_json

USUAL_NAME = "tileset.json"

MAX_TILES = 1_000_000
"""Maximum number of tiles of a tileset. Without a limit, small files that include each other could
have any number of tiles."""

FAR = 100_000.0
"""If a coordinate of the center of a tileset is at least `FAR` meters, `Tileset.origin` is not 0.
At this distance, the precision of float32 is 8 mm."""

_EQUATOR, _ECCENTRICITY = 6378137.0, 6.69437999014e-3
"""Equatorial radius of the WGS84 ellipsoid in meters, and its squared eccentricity."""


class Tile(NamedTuple):
    """A model of a tileset, and its placement."""

    path: Path
    name: str  # path relative to the folder of the tileset, with slashes
    placement: Placement


@dataclass(frozen=True)
class Tileset:
    """Models of a tileset, in the order of the tileset."""

    tiles: tuple[Tile, ...]
    origin: tuple[float, ...]  # subtracted from all positions; 0 if the tileset is not moved


class _Visit(NamedTuple):
    """A tile on the stack of the traversal."""

    tile: dict[str, Any]
    file: Path  # JSON file that contains the tile
    above: Floats  # global matrix of the parent tile
    refine: str  # refinement of the parent tile: "ADD" or "REPLACE"
    up: str  # up axis of the models in `file`
    files: tuple[Path, ...]  # chain of files that include each other, from the first to `file`


def tileset_at(path: Path) -> Path | None:
    """Return `path` if it ends in .json, or its file tileset.json if it is a folder, or None."""
    if path.suffix.lower() == ".json":
        return path
    inside = path / USUAL_NAME
    return inside if inside.is_file() else None


def read_tileset(path: Path) -> Tileset:
    """Return the models of a tileset at the highest level of detail, without reading the models.

    The content of a tile whose `refine` is ``"REPLACE"`` is skipped if the tile has children. All
    files must be in the folder of the tileset or in its subfolders.

    Raises
    ------
    MeshError
        If a file is damaged, includes itself, refers to a file outside the folder, or uses implicit
        tiling; or if there are no models, or more than `MAX_TILES` tiles.
    OSError
        If a file of the tileset cannot be read.
    """
    walk = _Walk(path.parent)
    found = [*walk.models(path)]
    if not found:
        raise MeshError(f"{path}: the tileset has no models")
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
    """Traversal of the tiles of a tileset and of included tilesets."""

    folder: Path
    documents: dict[Path, dict[str, Any]] = field(default_factory=dict)

    def models(self, path: Path) -> Iterator[tuple[Path, str, Floats, str]]:
        """Yield path, name, matrix and up axis of each model, in depth-first order."""
        stack = [self._root(path, np.eye(4), "REPLACE", ())]
        n_tiles = 1
        while stack:
            visit = stack.pop()
            with named_errors(visit.file):
                below, models = self._visited(visit)
            n_tiles += len(below)
            if n_tiles > MAX_TILES:
                raise MeshError(f"{path}: the tileset has more than {MAX_TILES} tiles")
            stack.extend(reversed(below))
            for file, name, matrix in models:
                yield file, name, matrix, visit.up

    def _visited(self, visit: _Visit) -> tuple[list[_Visit], list[tuple[Path, str, Floats]]]:
        """Return the children of a tile, and its models unless the children replace them."""
        tile, file = visit.tile, visit.file
        extensions = tile.get("extensions")
        named = extensions if isinstance(extensions, dict) else {}
        if "implicitTiling" in tile or "3DTILES_implicit_tiling" in named:
            raise MeshError("implicit tiling is not supported: convert to explicit tiles first")
        matrix = product(visit.above, _transform(tile)) if "transform" in tile else visit.above
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
        if file.resolve() in files:
            raise MeshError(f"the tileset {file.name} includes itself")
        if file not in self.documents:
            content = read_content(file)[:]
            with named_errors(file):
                self.documents[file] = _parsed(content)
        document = self.documents[file]
        up = str(document["asset"].get("gltfUpAxis", "Y")).upper()
        if up not in UP_AXES:
            raise MeshError(f"{file}: gltfUpAxis must be X, Y or Z, got {up[:20]!r}")
        return _Visit(document["root"], file, above, refine, up, (*files, file.resolve()))

    def _file_of(self, content: dict[str, Any], file: Path) -> tuple[Path, str]:
        """Return the file of a tile's content, and its path relative to the tileset's folder."""
        address = content.get("uri", content.get("url"))
        if not isinstance(address, str):
            raise MeshError("broken tileset: the content of a tile must have a uri")
        shown = repr(address if len(address) < 80 else f"{address[:77]}...")
        try:
            named = unquote(address.split("?")[0].split("#")[0], errors="strict")
            path = file_beside(named, file.parent, self.folder)
        except (OSError, ValueError):
            path = None
        if path is None:
            raise MeshError(f"the file {shown} is not in the folder of the tileset")
        return path, path.relative_to(self.folder.resolve()).as_posix()

    def origin(self, path: Path) -> Floats:
        """Return the center of the root tile in whole meters; 0 if no coordinate reaches `FAR`."""
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
            raise MeshError(f"{path}: the position of the tileset is not finite")
        rounded: Floats = np.rint(center) + 0.0  # converts -0.0 to 0.0
        return rounded if np.abs(center).max() >= FAR else np.zeros(3)


def _parsed(content: bytes) -> dict[str, Any]:
    """Parse the JSON of a tileset, or raise a MeshError if asset or root is missing."""
    document = parsed_json(content, "tileset")
    asset, root = document.get("asset"), document.get("root")
    if not isinstance(asset, dict) or not isinstance(root, dict):
        raise MeshError("not a tileset: the JSON must have the entries asset and root")
    version = asset.get("version")
    if not isinstance(version, str) or not version.startswith(("0.", "1.")):
        raise MeshError(f"the tileset version must be 1.0 or 1.1, got {version!r:.20}")
    return document


def _transform(tile: dict[str, Any]) -> Floats:
    """Return the matrix of a tile, or the identity. The file stores it column by column."""
    return numbers(tile, "transform", np.eye(4).ravel().tolist()).reshape(4, 4).T


def _contents(tile: dict[str, Any], extension: object) -> list[dict[str, Any]]:
    """Return the contents of a tile: several with 3D Tiles 1.1, or with an extension of 1.0."""
    found = [tile["content"]] if isinstance(tile.get("content"), dict) else []
    found += items(tile, "contents")
    if isinstance(extension, dict):
        found += items(extension, "contents") + items(extension, "content")
    return found


def _center_of_region(region: Floats) -> Floats:
    """Return the center of a region (west, south, east, north, low, high) as geocentric x, y, z."""
    west, south, east, north, low, high = region.tolist()
    longitude, latitude, height = (west + east) / 2, (south + north) / 2, (low + high) / 2
    if west > east:  # the region crosses the date line
        longitude += np.pi
    normal = _EQUATOR / np.sqrt(1 - _ECCENTRICITY * np.sin(latitude) ** 2)
    across = (normal + height) * np.cos(latitude)
    up = (normal * (1 - _ECCENTRICITY) + height) * np.sin(latitude)
    return np.array([across * np.cos(longitude), across * np.sin(longitude), up])
