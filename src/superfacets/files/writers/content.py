"""Define `Output`, the input of the functions that write a file in one format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.types import Array, Bytes, Ints
from ..attributes import MeshAttributes

if TYPE_CHECKING:
    from ... import Texture


@dataclass(frozen=True)
class Output:
    """Checked cells to write, with their labels, colors, attributes and format options.

    Functions that write a format get it as their second argument; see `files.formats`.
    """

    cells: Any
    ending: str
    labels: Ints | None = None
    colors: Bytes | None = None
    attributes: MeshAttributes | None = None
    vertex_labels: Ints | None = None
    classes: Sequence[str] | None = None
    label_name: str = "label"
    ascii: bool = False
    path: Path | None = None  # path of the output file; None for a stream

    @property
    def texture(self) -> Texture | None:
        """Texture of the attributes, or None if there is no texture."""
        return None if self.attributes is None else self.attributes.texture

    def part_names(self, values: Array) -> Array:
        """Return the name of the part of the file for each of the distinct labels, ascending.

        Names are ``region_17`` for label 17, or the name of its class with underscores instead of
        spaces, and ``unlabeled`` for label -1.
        """
        regions = [f"region_{value}" for value in values.tolist() if value >= 0]
        if self.classes is not None:
            regions = ["_".join(name.split()) or "unnamed" for name in self.classes]
        return np.array(["unlabeled"] * int((values < 0).any()) + regions)
