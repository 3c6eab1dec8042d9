"""Measure the quality of superpoints (regions of vertices) in scanned rooms, for several methods.

A room is an ``.npz`` file with ``vertices`` (V, 3), ``faces`` (F, 3) and ``instances`` (V,).
``instances`` is the true object of each vertex, or -1 for vertices without annotation. The file may
also contain ``colors`` (V, 3), and ``felzenszwalb`` (V,), the segment of each vertex from ScanNet's
segmenter. The noise level of a room is the end of its name, for example ``n1`` in ``office_n1``.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets.base.checks import checked_classes, checked_threads, ranked_labels
from superfacets.base.errors import IslandWarning, MeshError
from superfacets.base.types import Array, Bools, Ints, Longs
from superfacets.files.atomic import checked_targets
from superfacets.files.formats import FORMATS
from superfacets.files.guards import known_ending
from superfacets.files.readers.labels import read_labels
from superfacets.graph.sums import weighted_majority
from superfacets.mesh.faces import vertex_graph
from superfacets.mesh.meshes import Mesh
from superfacets.mesh.weld import lowest_vertices
from superfacets.metrics.overlap import achievable_accuracy, achievable_iou, overlap_of
from superfacets.pipeline import segment
from superfacets.regions.vertices import vertex_labels
from superfacets.stages.presets import SCANS

from .baselines.felzenszwalb import felzenszwalb_segments
from .table_writer import markdown_table, write_csv

ORIGINAL = "ScanNet's segmenter"
"""Name of the method that made the array ``felzenszwalb``."""

COMPUTED = "felzenszwalb_segments"
"""Name of the method that replaces `ORIGINAL` in rooms without the array ``felzenszwalb``."""

METHODS: dict[str, dict[str, Any]] = {"default": {}, "SCANS": dict(SCANS)}
"""Keywords of `segment` for each method, by the name of the method in the table."""

WITH_COLOR = "SCANS and color"
"""Name of the method `SCANS` with the colors of the room as features."""

_MAX_RUNS = 5


class Score(NamedTuple):
    """Quality of superpoints. A superpoint represents the most frequent object of its vertices."""

    n_superpoints: float
    error: float  # 1 - `achievable_accuracy` of `evaluate_vertices`
    error_away: float  # `error` among the vertices more than one edge away from object borders
    mean_iou: float  # `achievable_iou` of `evaluate_vertices`
    extra_pieces: float  # connected components of all superpoints, minus number of superpoints


@dataclass(frozen=True, eq=False)
class Room:
    """A scanned room: its mesh, the true object of each vertex, and segments of other methods."""

    name: str
    mesh: Mesh
    truth: Ints  # (V,) true object of each vertex, from 0; -1 means no annotation
    given: dict[str, Ints]  # for each other method, by name: (V,) segment of each vertex
    colors: Array | None = None  # (V, 3) color of each vertex

    @classmethod
    def read(cls, path: Path, folders: Iterable[Path] = ()) -> Room:
        """Read a room from a file, and segments of other methods from a label file in each folder.

        The first segments are those of ScanNet's segmenter; they are computed if the file does not
        contain them. The name of a label file is the name of the room, a dot, and an ending. If one
        of several label files of a room ends in .segs.json, it is read. Raises a MeshError if the
        file contains no room, or if it is not clear which label file to read.
        """
        try:
            with np.load(path) as file:
                arrays = [file[name] for name in ("vertices", "faces", "instances")]
                given = {ORIGINAL: file["felzenszwalb"]} if "felzenszwalb" in file else {}
                colors = file.get("colors")
        except (OSError, ValueError, KeyError) as error:
            raise MeshError(f"{path}: not a room: {error}") from error
        mesh = Mesh(*arrays[:2])
        given = given or {COMPUTED: felzenszwalb_segments(mesh)}
        given |= {str(folder): _labels_in(folder, path) for folder in folders}
        truth, *segments = (
            checked_classes(array, mesh.n_vertices, name, "vertex")
            for name, array in {"instances": arrays[2], **given}.items()
        )
        truth, names = ranked_labels(truth)
        if not len(names):
            raise MeshError(f"{path}: not a room: all instances are -1")
        return cls(path.stem, mesh, truth, dict(zip(given, segments, strict=True)), colors)

    @property
    def level(self) -> str:
        """Noise level of the room: the end of a name such as "office_n1", or else "all"."""
        found = re.search(r"_([a-z]\d)$", self.name)
        return "all" if found is None else found[1]

    @property
    def edges(self) -> Longs:
        """Vertices at the two ends of each edge of the mesh, (E, 2), the lower index first."""
        threads = checked_threads(None)
        lowest = lowest_vertices(self.mesh.vertices, False, threads)
        graph = vertex_graph(self.mesh, lowest, threads)
        sources = np.repeat(np.arange(self.mesh.n_vertices), np.diff(graph.offsets))
        ends = np.stack([sources, graph.neighbors], axis=1)
        return ends[ends[:, 0] < ends[:, 1]]

    @property
    def is_used(self) -> Bools:
        """Whether each vertex belongs to a face."""
        is_used = np.zeros(self.mesh.n_vertices, bool)
        is_used[self.mesh.faces] = True
        return is_used

    def superpoints(self, **options: Any) -> Ints:
        """Compute superpoints with `segment`, and return the superpoint of each vertex.

        Their number is about the number of segments of the first method in `given`.
        """
        asked = number = len(np.unique(next(iter(self.given.values()))[self.is_used]))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IslandWarning)
            for _ in range(_MAX_RUNS):  # repeated, because components without a seed add regions
                result = segment(self.mesh, max(asked, 1), **options)
                if result.n_segments <= number:
                    break
                asked -= result.n_segments - number
        return vertex_labels(self.mesh, result.labels, min_vertices=1)

    def scores(self) -> dict[str, Score]:
        """Return the score of each method, by name; segments of other methods come first."""
        found = {name: self.score(labels) for name, labels in self.given.items()}
        features = {} if self.colors is None else {WITH_COLOR: {**SCANS, "features": self.colors}}
        for name, options in {**METHODS, **features}.items():
            found[name] = self.score(self.superpoints(**options))
        return found

    def score(self, superpoints: npt.NDArray[np.integer[Any]]) -> Score:
        """Return the quality of superpoints. Vertices that belong to no face are ignored.

        Errors and IoU also ignore vertices without annotation.
        """
        used, edges = self.is_used, self.edges
        rated = used & (self.truth >= 0)
        ids = ranked_labels(superpoints + 1)[0]
        votes, n_ids = rated.astype(np.float64), ids.max() + 1
        overlap = overlap_of(ids, n_ids, self.truth, self.truth.max() + 1, votes)
        winners = weighted_majority(ids[rated], self.truth[rated], votes[rated], n_ids).winners
        is_wrong = (winners[ids] != self.truth) & rated
        is_away = rated & ~_near_borders(edges, self.truth)
        n = len(np.unique(ids[used]))
        return Score(
            n,
            1.0 - achievable_accuracy(overlap),
            is_wrong[is_away].sum() / max(is_away.sum(), 1),
            achievable_iou(overlap),
            _n_pieces(edges[ids[edges[:, 0]] == ids[edges[:, 1]]], used) - n,
        )


def study(paths: Iterable[Path], folders: Sequence[Path] = (), output: Path | None = None) -> str:
    """Return a Markdown table with the mean scores of all methods at each noise level.

    Each folder contains the label files of another method. The path of the folder is the name of
    the method. A method without segments of all rooms of a noise level is not listed for the level.
    If `output` is given, it becomes a CSV file with the scores of each room and method.
    """
    if output is not None:
        known_ending(output, (".csv",))
        checked_targets([output])
    rooms = [Room.read(path, folders) for path in sorted(paths)]
    if not rooms:
        raise MeshError("no rooms were found: the folder contains no .npz file")
    scores = {room.name: room.scores() for room in rooms}
    if output is not None:
        write_csv(output, [
            {"room": room, "method": name, **score._asdict()}
            for room, by_method in scores.items() for name, score in by_method.items()
        ])  # fmt: skip
    rows = []
    for level in dict.fromkeys(room.level for room in rooms):
        of_level = [scores[room.name] for room in rooms if room.level == level]
        for name in of_level[0]:
            if not all(name in by_method for by_method in of_level):
                continue
            mean = Score(*np.mean([by_method[name] for by_method in of_level], axis=0))
            shares = (f"{100 * mean.error:.3f}", f"{100 * mean.error_away:.3f}",
                      f"{100 * mean.mean_iou:.2f}")  # fmt: skip
            row = [level, name, f"{mean.n_superpoints:.0f}", *shares, f"{mean.extra_pieces:.1f}"]
            rows.append(row)
    head = ["level", "method", "superpoints", "error %", "away from borders %", "mean IoU %"]
    return markdown_table([*head, "extra pieces"], rows)


def _labels_in(folder: Path, room: Path) -> Ints:
    name = room.stem
    paths = [path for path in folder.glob(f"{name}.*") if path.name.endswith(FORMATS.labels)]
    if not paths:
        raise MeshError(
            f"{folder} has no labels of the room {name}: add {name}.segs.json or"
            f" {name}.0.010000.segs.json, or remove {room}"
        )
    # Segments are preferred to a picture of them, such as .ply.
    paths = [path for path in paths if path.name.endswith(".segs.json")] or paths
    if len(paths) > 1:
        found = ", ".join(sorted(path.name for path in paths))
        raise MeshError(f"{folder} has several label files of the room {name}, {found}: keep one")
    return read_labels(paths[0])


def _near_borders(edges: Longs, truth: Ints) -> Bools:
    """Return whether each vertex is at most one edge away from an edge between two objects.

    All vertices without annotation are treated as one more object.
    """
    is_near = np.zeros(len(truth), bool)
    is_near[edges[truth[edges[:, 0]] != truth[edges[:, 1]]]] = True
    is_near[edges[is_near[edges].any(axis=1)]] = True
    return is_near


def _n_pieces(edges: Longs, used: Bools) -> int:
    """Return the number of connected components of the graph `edges` that contain used vertices.

    This function needs SciPy.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(used)
    graph = coo_matrix((np.ones(len(edges), np.int8), tuple(edges.T)), (n, n))
    _, piece = connected_components(graph, directed=False)
    return len(np.unique(piece[used]))
