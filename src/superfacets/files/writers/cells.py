"""Write cells (faces, tetrahedra or points) with labels and colors to files.

`Output` is the input of the functions that write a file in one format.
"""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...base.checks import check_length, refuse_mask
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Bytes, Ints
from ...graph.kinds import Kind, kind_of
from ...mesh.attributes import COLORS, MeshAttributes, have_region_colors, is_image, stored_colors
from ...mesh.base import Cells
from ...regions.vertices import vertex_labels
from ..formats import FORMATS

if TYPE_CHECKING:
    from ... import Texture

_COLORLESS = (".obj", ".stl", ".csv", ".ids.png", *FORMATS["write_tetrahedra"])
"""Endings of formats that store no colors."""

NEW = "new "
"""Beginning of items of `Output.lost` about values that a writer replaces or adds."""

_ANY_PROPERTY = (".vtp", ".las", ".laz", *FORMATS["write_tetrahedra"])
"""Endings of formats that store properties of any name and integers of 64 bits, unlike PLY."""


@dataclass(frozen=True)
class FormatOptions:
    """Options that writers of formats get; `write_mesh` explains each option."""

    ascii: bool = False
    label_name: str = "label"
    vertex_labels: bool = False
    classes: tuple[str, ...] | None = None
    scores: tuple[float, ...] | None = None
    force: bool = False

    @classmethod
    def checked(
        cls, endings: Sequence[str], *, classes: Sequence[str] | Sequence[int] | None = None,
        scores: npt.ArrayLike | None = None, **others: Any,
    ) -> FormatOptions:  # fmt: skip
        """Return options; raise an error if one is invalid, or has no effect on any ending.

        A MissingExtraError is raised if the package that writes one of the endings is missing.
        """
        FORMATS.check_writers(endings)
        options = cls(**others)
        named = options.label_name
        if not isinstance(named, str) or not named or not named.isprintable():
            raise ValueError(f"label_name must be one line of printable text, got {named!r}")
        for name, is_given, fitting in (
            ("label_name", named != "label", (".vtp", *FORMATS["write_tetrahedra"])),
            ("vertex_labels", options.vertex_labels, (".ply",)),
            ("classes", classes is not None, FORMATS.class_outputs),
            ("scores", scores is not None, (".aggregation.json",)),
        ):
            if is_given and not {*endings} & {*fitting}:
                raise ValueError(f"{name} needs an output with the ending {' or '.join(fitting)}")
        names = None if classes is None else tuple(map(_checked_class, classes))
        return replace(options, classes=names, scores=_checked_scores(scores))

    def check_classes(self, labels: Ints | None, noun: str = "region") -> None:
        """Raise a MeshError unless there is one class or score per label, not counting -1."""
        for name, given in (("classes", self.classes), ("scores", self.scores)):
            if given is None:
                continue
            if labels is None:
                raise MeshError(f"{name} need labels, because there is one value per {noun}")
            check_length(given, len(np.unique(labels[labels >= 0])), name, noun, error=MeshError)


def _checked_scores(values: npt.ArrayLike | None) -> tuple[float, ...] | None:
    if values is None:
        return None
    scores = np.asarray(values, np.float64)
    if scores.ndim != 1 or not ((scores >= 0) & (scores <= 1)).all():
        raise ValueError(f"scores must be a list of numbers in [0, 1], got {reprlib.repr(values)}")
    return tuple(scores.tolist())


def _checked_class(value: object) -> str:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (str, int, np.integer)):
        raise TypeError(f"classes must be strings or integers, got {value!r}")
    return str(value)


@dataclass(frozen=True)
class Output:
    """Checked cells to write, with their labels, colors, attributes and format options.

    Functions that write a format get an `Output` as second argument; see `files.formats`. They mark
    the attributes that they store in `taken`; all other attributes are reported as lost.
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
    taken: set[str] = field(default_factory=set)  # attributes that the writer stores
    changed: list[str] = field(default_factory=list)  # what is stored in another form, and how

    def properties(self, owner: str, own: Mapping[str, Any] | None = None) -> dict[str, Array]:
        """Return the properties of the "vertex" or the "face" to write, and mark them as stored.

        `own` are the names and values that the writer itself writes, for example of labels. A
        property with such a name is replaced, unless it has the same values; it is lost if the own
        values are None.
        """
        own, stored = own or {}, self._stored(owner)
        self.taken.update(f"{owner} property {name}" for name in stored.keys() - own)
        self.replace(owner, own)
        return {name: values for name, values in stored.items() if name not in own}

    def replace(self, owner: str, own: Mapping[str, Any]) -> None:
        """Report that values replace properties of the attributes, unless equal or None."""
        stored = self._stored(owner)
        names = [name for name in stored if own.get(name) is not None]
        self.taken.update(f"{owner} property {name}" for name in names)
        if replaced := [name for name in names if not _are_equal(own[name], stored[name])]:
            self.changed.append(f"{NEW}values replace {_listed(owner, replaced)}")

    def stored_colors(self, owner: str) -> Bytes | None:
        """Return the colors of the attributes, (n, 3), if all are bytes; mark them as stored."""
        stored = self._stored(owner)
        if not all(name in stored and stored[name].dtype == np.uint8 for name in COLORS):
            return None
        self.taken.update(f"{owner} property {name}" for name in COLORS)
        return np.column_stack([stored[name] for name in COLORS])

    def _stored(self, owner: str) -> Mapping[str, Array]:
        return getattr(self.attributes, owner, {})

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
            lost += [_listed(owner, names)] * bool(names)
        others = {
            "texture": self.texture is not None,
            **{f"{name} names": True for name in self.attributes.names},
            str(self.attributes.header): self.attributes.header is not None,
            "comments": any(not is_image(line) for line in self.attributes.comments),
        }
        more = [item for item, is_there in others.items() if is_there and item not in self.taken]
        if "texture" in more and self.texture is not None and not len(self.texture.coordinates):
            more[more.index("texture")] = "materials"  # which have no texture
        return [*lost, *more, *self.changed]

    @property
    def texture(self) -> Texture | None:
        """Texture of the attributes, or None if there is no texture."""
        return None if self.attributes is None else self.attributes.texture

    @property
    def cloud_colors(self) -> Bytes | None:
        """Colors of points, (N, 3): the given ones, or those of the cloud; None without colors."""
        if self.colors is not None or self.cells.colors is None:
            return self.colors
        return np.asarray(np.rint(self.cells.colors * 255), np.uint8)

    def parts(self) -> tuple[Array, list[str]] | None:
        """Return the number of the named part of each face, and the names of the parts.

        There is a part per region: ``region_17`` for label 17, or the class of the region with
        underscores instead of spaces, and ``unlabeled`` for label -1. If the input has named parts,
        such as solids, and each region is a whole part, regions have the names of the parts.
        Otherwise, a region inside of one part has a name such as ``inlet_region_17``. Without
        labels, the input defines the parts. The result is None if there are no parts.
        """
        given = self._given_parts
        self.replace("face", {"label": self.labels})
        if self.labels is None:
            return given
        values, ranks = np.unique(self.labels, return_inverse=True)
        names = [f"region_{value}" if value >= 0 else "unlabeled" for value in values.tolist()]
        if self.classes is not None:
            words = MeshAttributes.as_words(self.classes, self.ending)
            names[len(names) - len(words) :] = words
        if given is not None and self._lose_parts(names, ranks, *given):
            self.changed.append("some part names, because regions have other names")
        return ranks, names

    def _lose_parts(self, names: list[str], ranks: Array, given: Array, parts: list[str]) -> bool:
        """Name regions by parts, unless there are classes; return whether names are lost."""
        numbers = given.astype(np.int64) % len(parts)  # -1, no part, becomes the last one
        regions, numbers = np.divmod(np.unique(ranks * len(parts) + numbers), len(parts))
        words, counts = [parts[part] for part in numbers], np.unique(regions, return_counts=True)[1]
        if self.classes is not None:
            return not {*words} <= {*names}
        is_same = "unlabeled" not in names and len(words) == len(names) == len({*words})
        for region, word in zip(regions.tolist(), words, strict=True):
            if counts[region] == 1 and names[region] != "unlabeled":
                names[region] = word if is_same else f"{word}_{names[region]}"
        return bool(counts.max() > 1)

    @property
    def _given_parts(self) -> tuple[Array, list[str]] | None:
        """Number of the named part of each face in the input, and the names of the parts."""
        stored, listed = self._stored("face"), getattr(self.attributes, "names", {})
        for name, names in listed.items():
            if name in stored and stored[name].max() < len(names):
                whole = [each if each.strip() else f"{name}_{i}" for i, each in enumerate(names)]
                words = MeshAttributes.as_words(whole, self.ending)
                self.taken.update((f"{name} names", f"face property {name}"))
                return stored[name], [*words, "unnamed"]
        return None


def _listed(owner: str, names: Sequence[str]) -> str:
    return f"{owner} {'properties' if len(names) > 1 else 'property'} {', '.join(names)}"


def _are_equal(own: Any, stored: Array) -> bool:
    """Return whether a property is the same as own values; NaN equals NaN."""
    # One value stands for all rows.
    values = np.broadcast_to(own, stored.shape) if np.ndim(own) == 0 else np.asarray(own)
    return np.array_equal(values, stored, equal_nan=stored.dtype.kind == "f")


@dataclass(frozen=True)
class CellWriter:
    """Writer of cells, labels, colors and attributes to mesh and point cloud files."""

    cells: Cells
    labels: Ints | None
    given_colors: Any
    attributes: MeshAttributes | None
    options: FormatOptions
    of_vertices: Ints | None = None  # given labels of vertices; None to compute them from `labels`
    groups: Ints | None = None  # `ConstraintOptions.groups_of_vertices` of the cells

    def checked(self, endings: Sequence[str]) -> CellWriter:
        """Return a writer with checked colors; raise an error if a format cannot store the data."""
        if not endings:
            return self
        kind = kind_of(self.cells)
        for ending in endings:
            _check_kind(kind, ending)
        self.options.check_classes(self.labels)
        if self.given_colors is not None and not {*endings}.isdisjoint(FORMATS["write_tetrahedra"]):
            raise ValueError(".vtu and .vtk cannot store colors: omit them")
        _check_attributes(self.attributes, self.cells)
        if self.options.vertex_labels and (self.labels is None or not kind.has_faces):
            raise MeshError("vertex_labels needs faces with labels")
        colors = _checked_colors(self.given_colors, self.cells)
        return replace(self, given_colors=colors)

    def write(self, file: IO[bytes], ending: str, path: Path | None = None) -> list[str]:
        """Write a file in the format of `ending`, and return the attributes that are lost."""
        options, of_vertices = self.options, None
        attributes, changed = self.attributes, list[str]()
        if attributes is not None and ending not in _ANY_PROPERTY:
            attributes, changed = attributes.as_in_ply()
        if ending == ".ply" and options.vertex_labels:
            assert self.labels is not None
            of_vertices = self.of_vertices
            if of_vertices is None:
                of_vertices = vertex_labels(self.cells, self.labels, barriers=self.groups)
        if attributes is not None and self.labels is not None and ending == ".vtp":
            attributes = attributes.without_region_colors()
        texture = None if attributes is None else attributes.texture
        # Viewers multiply vertex colors with the texture. Therefore, a GLB file with a texture gets
        # only given colors, and no colors that are computed from labels.
        is_plain = ending in _COLORLESS or (ending == ".glb" and texture is not None)
        colors = self.given_colors if is_plain else self._colors
        content = Output(
            self.cells, ending, self.labels, colors, attributes, of_vertices,
            options.classes, options.label_name, options.ascii, path, changed=changed,
        )  # fmt: skip
        FORMATS.writers[kind_of(self.cells).name][ending](file, content)
        return content.lost

    @cached_property
    def _colors(self) -> Bytes | None:
        """Return given colors, or colors of labels; None without labels, or for colored clouds."""
        if self.given_colors is not None or self.labels is None:
            return self.given_colors  # type: ignore[no-any-return]  # see `checked`
        stored = {} if self.attributes is None else self.attributes.vertex
        has_colors = stored_colors(self.cells, self.attributes) is not None
        if kind_of(self.cells).are_points and has_colors and not have_region_colors(stored):
            return None
        colors: Bytes = load("superfacets_show.colors:face_colors")(self.cells, self.labels)
        return colors


def _check_kind(kind: Kind, ending: str) -> None:
    if kind.name not in FORMATS.writers:
        raise MeshError(
            f"{kind.plural} cannot be written as a mesh: write only their labels (.npy, .seg, .txt)"
        )
    fitting = tuple(FORMATS.writers[kind.name])
    if ending not in fitting:
        listed = f"{', '.join(fitting[:-1])} or {fitting[-1]}"
        table = "; for a table of regions, use superfacets regions" if ending == ".csv" else ""
        is_cut = kind.has_faces and ending in FORMATS.writers["triangles"]
        which = f"{kind.plural} with more than three corners" if is_cut else kind.plural
        raise MeshError(f"{which} are written as {listed}, not as {ending}{table}")


def _checked_colors(colors: Any, mesh: Cells) -> Bytes | None:
    if colors is None:
        return None
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    if array.shape != (mesh.n_cells, 3):
        raise ValueError(f"colors must have shape ({mesh.n_cells}, 3), got {array.shape}")
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 255:
        raise ValueError("colors must be integers from 0 to 255 (red, green, blue)")
    return array.astype(np.uint8)


def _check_attributes(attributes: Any, cells: Any) -> None:
    """Raise an error if `attributes` has a wrong type, or if its arrays do not match `cells`."""
    if attributes is None:
        return
    if not isinstance(attributes, MeshAttributes):
        raise TypeError(f"attributes must be MeshAttributes, got {type(attributes).__name__}")
    kind = kind_of(cells)
    are_points = kind.are_points
    n_vertices = cells.n_cells if are_points else cells.n_vertices
    for owner, n_rows in (("vertex", n_vertices), ("face", 0 if are_points else cells.n_cells)):
        for name, array in getattr(attributes, owner).items():
            check_length(array, n_rows, f"the {owner} property {name}", owner)
    if attributes.texture is not None:
        if not kind.has_faces:
            raise ValueError(f"{kind.plural} cannot have a texture")
        load("superfacets_textures.texels:check_texture")(attributes.texture, cells)
