"""Write labels of cells, vertices or triangles to label files."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...base.checks import counted, ranked_labels
from ...base.errors import MeshError
from ...base.lazy import Table, load
from ...base.types import Ints, Longs
from ...graph.kinds import kind_of
from ...mesh.attributes import MeshAttributes
from ...regions.vertices import nested_labels, vertex_ids
from ..formats import FORMATS
from .cells import NEW, FormatOptions
from .text_formats import write_npy, write_rows

_SCANS = Table({name: f"superfacets_scans.scannet:{name}" for name in (
    "check_ids", "check_nested", "check_triangles", "name_in_groups", "scene_of",
    "write_aggregation", "write_segments", "write_sstk", "write_superpoints", "write_tensor",
)})  # fmt: skip
"""Functions for formats of indoor scans, by name."""

_CORTEX = "superfacets_formats.cortex_writer:write_cortex"
_PALETTE = "superfacets_show.colors:PALETTE"

_TO_GET_IDS = ": vertices without a face or region get ids only if you pass labels of faces"
SEGMENTS, GROUPS, LEVELS = ".segs.json", ".aggregation.json", ".sstk.json"


@dataclass(frozen=True)
class IdWriter:
    """Writer of labels to label files, and of region graphs to graph files."""

    cells: Any  # None if only labels are known
    labels: Ints | None
    options: FormatOptions
    attributes: MeshAttributes | None = None  # attributes of the cells
    of_vertices: Ints | None = None  # given labels of vertices; None to compute them from `labels`
    segments: tuple[Ints, Ints, Path] | None = None
    """Segments to write instead: the segment id of each vertex, (V,), or -1; the object of each
    segment, (K,), in ascending order of ids, or -1; and the ``.segs.json`` file with the ids."""
    segments_file: Path | None = None  # the ``.segs.json`` file that is written with this file
    coarser: Sequence[Ints] = ()  # coarser levels of `labels`
    groups: Ints | None = None  # `ConstraintOptions.groups_of_vertices` of the cells
    finer: Ints | None = None  # labels of a finer level, which are converted to labels of vertices
    weld: float = True  # same as in `region_graph`

    def checked(self, endings: Sequence[str]) -> IdWriter:
        """Return self, or raise a MeshError if a format of `endings` cannot store the labels."""
        for ending in endings:
            if self.labels is None:
                raise MeshError(f"a {ending} file needs labels, but none are given")
            labels = self._labels_in(ending)
            if ending in FORMATS.vertex_outputs and labels.min() < 0:
                first = int(np.argmin(labels))
                text = f"labels[{first}] must be >= 0 in {ending}, got {labels[first]}"
                raise MeshError(text if self.of_vertices is None else text + _TO_GET_IDS)
            if ending in FORMATS.key_labels:
                _SCANS["check_ids"](labels)
            if ending in FORMATS.graph_outputs and labels.max() < 0:
                raise MeshError("a graph needs at least one region, but all labels are -1")
            if ending == LEVELS:
                _SCANS["check_nested"]([self.labels, *self.coarser])
                if self.cells is not None:
                    _SCANS["check_triangles"](self.cells)
            if ending in (GROUPS, *FORMATS.key_labels):
                self.options.check_classes(labels)
        return self

    def _labels_in(self, ending: str) -> Ints:
        """Return given labels of vertices in `Formats.unconverted_outputs`, or labels of cells."""
        assert self.labels is not None
        if self.segments is not None and ending in FORMATS.vertex_outputs:
            return self.segments[0]
        if self.of_vertices is not None and ending in FORMATS.unconverted_outputs:
            return self.of_vertices
        return self.labels

    def write(self, file: IO[bytes], ending: str, path: Path | None = None) -> list[str]:
        """Write a file in the format of `ending`; the scene name is taken from `path`."""
        assert self.labels is not None
        has_ids = self.segments is None and ending in FORMATS.vertex_outputs
        has_ids |= ending in FORMATS.graph_outputs
        labels = self._vertex_ids if has_ids else self._labels_in(ending)
        are_new = (labels > self.labels.max()) & (has_ids and self.of_vertices is None)
        if ending in FORMATS.graph_outputs:
            (ranks, names), are_points = ranked_labels(labels), kind_of(self.cells).are_points
            make = "region_graph" if are_points else "superpoint_graph"
            graph_of = load(f"superfacets.regions.region_graph:{make}")
            graph = graph_of(self.cells, ranks, weld=self.weld)
            write = load("superfacets_scans.pyg:write_graph_of")
            write(file, graph, names, None if are_points else ranks)
        elif ending in FORMATS.key_labels:
            self._write_cortex(file, ending)
        elif ending == GROUPS:
            self._write_groups(file, _SCANS["scene_of"](path, ending))
        elif ending == SEGMENTS:
            _SCANS["write_segments"](file, labels, _SCANS["scene_of"](path, ending))
        elif ending == LEVELS:
            _SCANS["write_sstk"](file, [labels, *self.coarser])
        elif ending == ".pth":
            _SCANS["write_tensor"](file, labels)
        elif ending in FORMATS.vertex_outputs:
            _SCANS["write_superpoints"](file, labels, ending)
        elif ending == ".npy":
            write_npy(file, labels)
        else:
            write_rows(file, "%d\n", [labels])
        new = counted(int(are_new.sum()), "vertex")
        return [f"{NEW}ids for {new} without a face or region"] * bool(are_new.any())

    def _write_groups(self, file: IO[bytes], scene: str) -> None:
        segments_file = self.segments_file
        if self.segments is not None:
            ids, objects, source = self.segments
            segments, segments_file = ranked_labels(ids)[1], segments_file or source
        else:
            labels = self._labels_in(GROUPS)
            segments = objects = np.unique(labels[labels >= 0])
            if segments_file is not None:  # a region without a vertex is not in this file
                segments = objects = np.intersect1d(segments, self._vertex_ids)
        name = None if segments_file is None else _SCANS["name_in_groups"](segments_file)
        _SCANS["write_aggregation"](
            file, segments, objects, scene, classes=self.options.classes,
            scores=self.options.scores, segments_file=name,
        )  # fmt: skip

    def _write_cortex(self, file: IO[bytes], ending: str) -> None:
        cells, labels = self.cells, self.labels
        assert labels is not None
        comments = () if self.attributes is None else self.attributes.comments
        ids, colors = self.of_vertices, load(_PALETTE)
        given = ranked_labels(self._labels_in(ending))[1].tolist()
        names = dict(zip(given, self.options.classes or (), strict=False))
        if ids is None:
            ids = nested_labels(cells, labels, self.finer, min_vertices=1, barriers=self.groups)
            regions, firsts = np.unique(labels, return_index=True)
            shown = firsts[np.isin(regions, ids) & (regions >= 0)]
            if len(shown) < (n := int(np.count_nonzero(regions >= 0))):
                held = f"{ending} has {len(shown):,} of {n:,} regions: the others have no vertex"
                warnings.warn(held, stacklevel=2)
            colors = load("superfacets_show.colors:face_colors")(cells, labels)[shown]
        load(_CORTEX)(file, ending, ids, colors, comments=comments, names=names)

    @property
    def region_sizes(self) -> Longs:
        """Number of vertices with the id of each region, in ascending order of the labels."""
        assert self.labels is not None
        regions, ids = np.unique(self.labels[self.labels >= 0]), np.sort(self._vertex_ids)
        return np.searchsorted(ids, regions, side="right") - np.searchsorted(ids, regions)

    @cached_property
    def _vertex_ids(self) -> Longs:
        assert self.labels is not None
        if self.of_vertices is not None:
            return self.of_vertices.astype(np.int64)
        return vertex_ids(self.cells, self.labels, self.groups, self.finer)
