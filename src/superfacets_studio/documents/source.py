"""Read the input file of a document, and detect later changes of the file."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from superfacets import Texture, kit
from superfacets.kit import Bytes, CellFile, Cells, kind_of, read_content, stored_colors


class ChangedError(RuntimeError):
    """Error raised if the input file has changed since the studio read it."""


@dataclass
class Source:
    """Content of an input file, and data to detect changes of the file."""

    path: Path
    cells: Cells
    size: int  # size of the file in bytes
    digest: str  # SHA-256 hash of the file
    _seen: tuple[int, int] | None  # time and size from `_stamp` when the file was read
    texture: Texture | None = None
    color_features: Callable[[], Any] | None = None  # returns colors as features of `segment`
    colors: Bytes | None = None  # red, green and blue of each cell or each vertex

    @classmethod
    def read(cls, path: Path) -> Source:
        """Read an input file; raise a MeshError or OSError if this fails."""
        seen = _stamp(path)
        file = CellFile.read(path)
        cells, attributes = file.cells_and_attributes()
        texture = None if attributes is None else attributes.texture
        colors = stored_colors(cells, attributes)
        digest = hashlib.sha256(file.data).hexdigest()
        data, names = kit.CellData(cells, attributes), ("color",)
        has_colors = colors is not None or texture is not None
        features = partial(data.features, names, kit.checked_threads(None)) if has_colors else None
        return cls(path, cells, len(file.data), digest, seen, texture, features, colors)

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return self.cells.n_cells

    @property
    def kind(self) -> str:
        """Name of the kind of cells in the front end, which calls tetrahedra "tets"."""
        name = kind_of(self.cells).name
        return "tets" if name == "tetrahedra" else name

    @property
    def facts(self) -> dict[str, Any]:
        """Entries that identify the input in the first line of a work file."""
        file = {"name": self.path.name, "size": self.size, "sha256": self.digest}
        return {"file": file, "kind": self.kind, "n_cells": self.n_cells}

    def check(self) -> None:
        """Raise a ChangedError if the content of the file has changed since it was read."""
        stamp = _stamp(self.path)
        if stamp == self._seen:
            return
        if stamp is None or hashlib.sha256(read_content(self.path)).hexdigest() != self.digest:
            raise ChangedError(
                f"{self.path.name} has changed since the studio read it: restore the old file, or"
                " start the studio again and give --work a new file (all work is saved)"
            )
        self._seen = stamp


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return the modification time and the size of a file, or None if it does not exist."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
