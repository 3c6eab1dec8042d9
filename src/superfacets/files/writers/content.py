"""Define `Output`, the input of the functions that write a file in one format."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.lazy import load
from ...base.types import Array, Bytes, Ints
from ..attributes import COLORS, MeshAttributes, is_image

if TYPE_CHECKING:
    from ... import Texture


@dataclass(frozen=True)
class Output:
    """Checked cells to write, with their labels, colors, attributes and format options.

    Functions that write a format get it as their second argument; see `files.formats`. They mark
    in `taken` which attributes they store, so that all others are known to be lost.
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
    taken: set[str] = field(default_factory=set)  # what the writer stores of the attributes
    changed: list[str] = field(default_factory=list)  # what it stores in another way, and how

    def properties(self, owner: str, own: Mapping[str, Any] | None = None) -> dict[str, Array]:
        """Return the properties of the "vertex" or the "face" to write, and mark them as stored.

        `own` are the names and values that the writer itself writes, for example of labels. A
        property with such a name is lost, unless it has the same values.
        """
        own, stored = own or {}, self._stored(owner)
        same = [name for name in own.keys() & stored.keys() if _are_equal(own[name], stored[name])]
        self.taken.update(f"{owner} property {name}" for name in (*(stored.keys() - own), *same))
        return {name: values for name, values in stored.items() if name not in own}

    def stored_colors(self, owner: str) -> Bytes | None:
        """Return the colors of the attributes, (n, 3), if all are bytes; mark them as stored."""
        stored = self._stored(owner)
        if not all(name in stored and stored[name].dtype == np.uint8 for name in COLORS):
            return None
        self.taken.update(f"{owner} property {name}" for name in COLORS)
        return np.column_stack([stored[name] for name in COLORS])

    def _stored(self, owner: str) -> Mapping[str, Array]:
        stored: Mapping[str, Array] = getattr(self.attributes, owner, {})
        return stored

    @property
    def lost(self) -> list[str]:
        """Attributes that the writer did not store, or did not store as they are."""
        if self.attributes is None:
            return []
        has_texture = "texture" in self.taken
        done = load("superfacets_textures.ply_texture:OF_TEXTURE") if has_texture else ()
        lost = []
        for owner in ("vertex", "face"):
            listed = [name for name in self._stored(owner) if name not in done]
            names = [name for name in listed if f"{owner} property {name}" not in self.taken]
            if names:
                many = "properties" if len(names) > 1 else "property"
                lost.append(f"{owner} {many} {', '.join(names)}")
        others = {
            "texture": self.texture is not None,
            **{f"names of {name}s": True for name in self.attributes.names},
            str(self.attributes.header): self.attributes.header is not None,
            "comments": any(not is_image(line) for line in self.attributes.comments),
        }
        more = [item for item, is_there in others.items() if is_there and item not in self.taken]
        return [*lost, *more, *self.changed]

    @property
    def texture(self) -> Texture | None:
        """Texture of the attributes, or None if there is no texture."""
        return None if self.attributes is None else self.attributes.texture

    @property
    def cloud_colors(self) -> Bytes | None:
        """Given colors of points, or else colors of the cloud, (N, 3); None if there are none."""
        if self.colors is not None or self.cells.colors is None:
            return self.colors
        return np.asarray(np.rint(self.cells.colors * 255), np.uint8)

    def parts(self) -> tuple[Array, list[str]] | None:
        """Return the number of each face's named part of the file, and the names of the parts.

        There is a part per region: ``region_17`` for label 17, or the class of the region with
        underscores instead of spaces, and ``unlabeled`` for label -1. If the input has named parts,
        such as solids, and a region is inside of one part, its name begins with the name of the
        part, for example ``inlet_region_17``. Without labels, the parts are those of the input. The
        result is None if there are none.
        """
        given = self._given_parts
        if self.labels is None:
            return given
        values, ranks = np.unique(self.labels, return_inverse=True)
        n_unlabeled = int((values < 0).any())
        names = [f"region_{value}" for value in values[n_unlabeled:].tolist()]
        if self.classes is not None:
            names = ["_".join(name.split()) or "unnamed" for name in self.classes]
        elif given is not None:
            lowest, highest = np.full(len(values), len(given[1])), np.full(len(values), -1)
            np.minimum.at(lowest, ranks, given[0])
            np.maximum.at(highest, ranks, given[0])
            for place, part in enumerate(highest[n_unlabeled:].tolist()):
                if lowest[place + n_unlabeled] == part:
                    names[place] = f"{given[1][part]}_{names[place]}"
        return ranks, ["unlabeled"] * n_unlabeled + names

    @property
    def _given_parts(self) -> tuple[Array, list[str]] | None:
        """Number of the named part of each face in the input, and the names of the parts."""
        stored, listed = self._stored("face"), getattr(self.attributes, "names", {})
        for name, names in listed.items():
            if name in stored and stored[name].max() < len(names):
                words = ["_".join(each.split()) or f"{name}_{i}" for i, each in enumerate(names)]
                self.taken.update((f"names of {name}s", f"face property {name}"))
                return stored[name], [*words, "unnamed"]  # -1, no part, stands for the last one
        return None


def _are_equal(own: Any, stored: Array) -> bool:
    """Return whether a property is the same as own values; NaN equals NaN."""
    is_real = stored.dtype.kind == "f"
    values = np.asarray(own)  # one value stands for all rows
    values = np.broadcast_to(values, stored.shape) if values.ndim == 0 else values
    return own is not None and np.array_equal(values, stored, equal_nan=is_real)
