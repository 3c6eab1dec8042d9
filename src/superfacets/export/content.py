"""Input of the writers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._types import Bytes, Ints
from ..io.attributes import MeshAttributes
from ..io.textures import Texture


@dataclass(frozen=True)
class Content:
    """Checked cells, with the labels, colors and attributes to write, and options of formats."""

    cells: Any
    ending: str
    labels: Ints | None = None
    colors: Bytes | None = None
    attributes: MeshAttributes | None = None
    vertex_labels: Ints | None = None
    classes: Sequence[str] | None = None
    label_name: str = "label"
    ascii: bool = False
    path: Path | None = None  # of the file; None for a stream

    @property
    def texture(self) -> Texture | None:
        """The texture of the attributes, if there is one."""
        return None if self.attributes is None else self.attributes.texture
