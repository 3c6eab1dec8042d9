"""One run: a mesh, a method, its alpha and a number of regions; and its record."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import __version__
from ..sources import Source
from ..tasks import Piece
from .methods import METHODS, Setting

_RECORD_VERSION = 2  # raised when records hold something else


@dataclass(frozen=True)
class Run:
    """What one record is about."""

    source: Source
    method: str
    alpha: float | None
    """None for methods that have none."""
    k: int

    def setting(self, most_segments: int, max_memory: int) -> Setting:
        """Return what the method is run with."""
        seed = self.source.number or zlib.crc32(self.source.name.encode())
        return Setting(
            alpha=self.alpha, most_segments=most_segments, seed=seed, max_memory=max_memory
        )

    def key(self, most_segments: int) -> dict[str, Any]:
        """Return everything that the result depends on; a record with another key is stale."""
        method = METHODS[self.method]
        setting = self.setting(most_segments, max_memory=0)
        return {
            "record": _RECORD_VERSION,
            "superfacets": __version__,
            "mesh": self.source.digest,
            "method": [self.method, method.version],
            "settings": {name: getattr(setting, name) for name in method.depends_on},
            "k": self.k,
        }

    def piece(self, folder: Path, most_segments: int) -> Piece:
        """Return the run with its record: ``METHOD/MESH/alpha-A_k-K.json`` in the folder."""
        alpha = "none" if self.alpha is None else f"{self.alpha:g}"
        path = folder / self.method / self.source.name / f"alpha-{alpha}_k-{self.k}.json"
        return Piece(self, path, self.key(most_segments))
