"""Write labels of cells, vertices or triangles to label files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...base.checks import ranked_labels
from ...base.errors import MeshError
from ...base.lazy import Table, load
from ...base.types import Ints, Longs
from ...graph.kinds import kind_of
from ...mesh.base import Cells
from ...regions.vertices import vertex_ids, vertex_labels
from ..attributes import MeshAttributes
from ..formats import FORMATS
from ..readers.labels import checked_labels
from .cells import FormatOptions
from .text import write_npy, write_rows

_SCANS = Table({name: f"superfacets_scans.scannet:{name}" for name in (
    "check_ids", "check_nested", "check_torch", "check_triangles", "name_in_groups", "scene_of",
    "write_aggregation", "write_segments", "write_sstk", "write_superpoints", "write_tensor",
)})  # fmt: skip
"""Functions for formats of indoor scans, by name."""

_CORTEX = "superfacets_formats.cortex_writer:write_cortex"
_PALETTE = "superfacets_show.colors:PALETTE"

SEGMENTS = ".segs.json"


@dataclass(frozen=True)
class Segments:
    """Segments of a mesh, and the object of each segment. A segment is the vertices with one id."""

    ids: Ints  # (V,) id of each vertex, or -1 for no segment
    objects: Ints  # (K,) object of each segment, in ascending order of ids; -1 for no object
    file: Path  # the ``.segs.json`` file that contains `ids`


@dataclass(frozen=True)
class IdWriter:
    """Writer of labels to label files, and of region graphs to graph files."""

    cells: Cells
    labels: Ints | None
    options: FormatOptions
    of_vertices: Ints | None = None  # given labels of vertices; None to compute them from `labels`
    segments: Segments | None = None  # given segments, to write in place of the labels of vertices
    segments_file: Path | None = None  # the ``.segs.json`` file that is written together with this
    attributes: MeshAttributes | None = None  # attributes of the cells

    def checked(self, endings: Sequence[str]) -> IdWriter:
        """Return self, or raise a MeshError if a format of `endings` cannot store the labels."""
        for ending in endings:
            if self.labels is None:
                raise MeshError(f"a {ending} file needs labels, but none are given")
            _check_labels(self._labels_in(ending), ending)
            if ending in FORMATS.graph_outputs and self.labels.max() < 0:
                raise MeshError("a graph needs at least one region, but all labels are -1")
            if ending == ".sstk.json":
                _SCANS["check_triangles"](self.cells)
            if ending == ".aggregation.json":
                self.options.check_classes(self._labels_in(ending))
        return self

    def _labels_in(self, ending: str) -> Ints:
        """Return given labels of vertices in `Formats.unconverted_outputs`, or labels of cells."""
        assert self.labels is not None
        if self.segments is not None and ending in FORMATS.vertex_outputs:
            return self.segments.ids
        if self.of_vertices is not None and ending in FORMATS.unconverted_outputs:
            return self.of_vertices
        return self.labels

    def write(self, file: IO[bytes], ending: str, path: Path | None = None) -> list[str]:
        """Write a file in the format of `ending`; the scene name is taken from `path`."""
        assert self.labels is not None
        if ending in FORMATS.graph_outputs:
            ids = None if kind_of(self.cells).are_points else self._vertex_ids
            load("superfacets_scans.pyg:write_graph_of")(file, self.cells, self.labels, ids)
        elif ending in FORMATS.key_labels:
            self._write_cortex(file, ending)
        elif ending == ".aggregation.json":
            self._write_groups(file, _SCANS["scene_of"](path, ending))
        else:
            has_ids = ending in FORMATS.vertex_outputs and self.segments is None
            labels = self._vertex_ids if has_ids else self._labels_in(ending)
            write_levels(file, ending, path, [labels])
        return []

    def _write_groups(self, file: IO[bytes], scene: str) -> None:
        segments_file = self.segments_file
        if self.segments is not None:
            segments, objects = ranked_labels(self.segments.ids)[1], self.segments.objects
            segments_file = segments_file or self.segments.file
        else:
            labels = self._labels_in(".aggregation.json")
            segments = objects = np.unique(labels[labels >= 0])
            if segments_file is not None:  # a region without a vertex is not in this file
                segments = objects = np.intersect1d(segments, self._vertex_ids)
        name = None if segments_file is None else _SCANS["name_in_groups"](segments_file)
        _SCANS["write_aggregation"](
            file, segments, objects, scene, classes=self.options.classes,
            scores=self.options.scores, segments_file=name,
        )  # fmt: skip

    def _write_cortex(self, file: IO[bytes], ending: str) -> None:
        assert self.labels is not None
        comments = () if self.attributes is None else self.attributes.comments
        of_vertices, colors = self.of_vertices, load(_PALETTE)
        if of_vertices is None:
            of_vertices = vertex_labels(self.cells, self.labels, min_vertices=1)
            regions, firsts = np.unique(self.labels, return_index=True)
            shown = firsts[np.isin(regions, of_vertices) & (regions >= 0)]
            colors = load("superfacets_show.colors:face_colors")(self.cells, self.labels)[shown]
        load(_CORTEX)(file, ending, of_vertices, colors, comments=comments)

    @property
    def region_sizes(self) -> Longs:
        """Number of vertices with the id of each region, in ascending order of the labels."""
        assert self.labels is not None
        regions, ids = np.unique(self.labels), np.sort(self._vertex_ids)
        return np.searchsorted(ids, regions, side="right") - np.searchsorted(ids, regions)

    @cached_property
    def _vertex_ids(self) -> Longs:
        assert self.labels is not None
        if self.of_vertices is not None:
            return self.of_vertices.astype(np.int64)
        return vertex_ids(self.cells, self.labels)


def checked_levels(labels: npt.ArrayLike, ending: str) -> list[Ints]:
    """Return one or more levels of labels; raise an error if the format cannot store them."""
    if ending == ".sstk.json" and np.ndim(labels) == 2:
        levels = [checked_labels(level) for level in np.asarray(labels)]
        _SCANS["check_nested"](levels)
        return levels
    checked = checked_labels(labels)
    _check_labels(checked, ending)
    return [checked]


def write_levels(
    file: IO[bytes], ending: str, path: Path | None, levels: Sequence[npt.NDArray[np.integer[Any]]]
) -> None:
    """Write labels in the format of `ending`; only ``.sstk.json`` stores more than one level."""
    labels = levels[0]
    if ending == ".segs.json":
        _SCANS["write_segments"](file, labels, _SCANS["scene_of"](path, ending))
    elif ending == ".aggregation.json":
        segments = np.unique(labels[labels >= 0])
        _SCANS["write_aggregation"](file, segments, segments, _SCANS["scene_of"](path, ending))
    elif ending == ".sstk.json":
        _SCANS["write_sstk"](file, levels)
    elif ending == ".pth":
        _SCANS["write_tensor"](file, labels)
    elif ending in FORMATS.vertex_outputs:
        _SCANS["write_superpoints"](file, labels, ending)
    elif ending in FORMATS.key_labels:
        load(_CORTEX)(file, ending, labels, load(_PALETTE))
    elif ending == ".npy":
        write_npy(file, labels)
    else:
        write_rows(file, "%d\n", [labels])


def _check_labels(labels: Ints, ending: str) -> None:
    if ending in FORMATS.vertex_outputs and labels.min() < 0:
        first = int(np.argmin(labels))
        raise MeshError(f"labels[{first}] must be >= 0 in {ending}, got {labels[first]}")
    if ending == ".pth":
        _SCANS["check_torch"]()
    if ending in FORMATS.key_labels:
        _SCANS["check_ids"](labels)
