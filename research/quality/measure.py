"""Segment models at several resolutions with variants of `segment`, and measure the regions."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from superfacets import __version__, metrics, paper
from superfacets.base.types import Bools, Floats, Ints
from superfacets.clustering.result import Segmentation
from superfacets.graph.face_graph import build_face_graph
from superfacets.graph.surface import arc_measures
from superfacets.mesh.meshes import Mesh
from superfacets.pipeline import run, segment
from superfacets.stages.options import SegmentOptions
from superfacets.tools.sample import split_in_four
from superfacets.weights.formulas import Weights

from ..sources import StudyMesh, load_model
from ..tasks import Record, WorkItem

KS = (50, 100, 150, 200, 300)

PAPERS = "paper"
PLAIN = "plain"
CREASES = "creases"
DEFAULT = "default"
NOT_RELOCATED = "default, not relocated"
NO_RIDGES = "default, no ridges"
EQ_2 = "eq. 2"

_PLAIN: dict[str, Any] = {"weights": "superfacets", "init": "farthest", "smooth": False}

VARIANTS: Mapping[str, Mapping[str, Any]] = {
    PAPERS: {},
    PLAIN: _PLAIN,
    "plain, smooth": _PLAIN | {"smooth": True},
    "creases, alpha 10": {"weights": "creases", "alpha": 10.0},
    CREASES: {"weights": "creases"},
    "creases, alpha 30": {"weights": "creases", "alpha": 30.0},
    "creases, alpha 40": {"weights": "creases", "alpha": 40.0},
    EQ_2: {"weights": Weights("superfacets", eta_convex=0.0)},
    "default, alpha 10": {"alpha": 10.0},
    DEFAULT: {},
    "default, alpha 30": {"alpha": 30.0},
    "default, alpha 40": {"alpha": 40.0},
    NOT_RELOCATED: {},
    NO_RIDGES: {"weights": Weights(ridges=0.0)},
    "default, eta 0.2": {"weights": Weights(eta_convex=0.2)},
    "default, not smooth": {"smooth": False},
}
"""Keywords of `superfacets.segment` for each variant. `PAPERS` is the method of the paper. `PLAIN`
has the same weights and seeds, but another stop criterion. In `PLAIN`, each face gets the label of
the nearest center, so there are exactly k regions, and they are connected. `segment_as` runs any
variant."""


def segment_as(
    variant: str, mesh: Mesh, n_segments: int, n_threads: int | None = None
) -> Segmentation:
    """Segment a mesh with one of the `VARIANTS`."""
    if variant == PAPERS:
        return paper.segment(mesh, n_segments, n_threads=n_threads)
    given = {**VARIANTS[variant], "n_segments": n_segments, "n_threads": n_threads}
    if variant != NOT_RELOCATED:
        return segment(mesh, **given)
    usual = {name: one.default for name, one in signature(segment).parameters.items()}
    del usual["mesh"]
    return run(mesh, replace(SegmentOptions.checked(**usual | given), may_relocate=False))


RESOLUTION_VARIANTS = (PLAIN, EQ_2, CREASES, DEFAULT)
"""Variants that are measured at all resolutions of a model."""


SHARP = math.radians(45)  # minimum angle between the normals at a crease, in radians


class Subject(NamedTuple):
    """A mesh, and segmentations (ground truths) of this mesh by several people."""

    mesh: Mesh
    truths: tuple[Ints, ...]


class Creases(NamedTuple):
    """Creases of a mesh: the two faces at each crease edge, and the length of the edge.

    Each edge occurs twice, with the two faces in both orders.
    """

    sources: Ints
    targets: Ints
    lengths: Floats

    def share_between(self, labels: Ints) -> float | None:
        """Return the fraction of crease length on region borders, or None without creases."""
        total = self.lengths.sum()
        between = labels[self.sources] != labels[self.targets]
        return float(self.lengths[between].sum() / total) if total > 0 else None


def refined(subject: Subject, levels: int = 1) -> Subject:
    """Split each face into four, `levels` times.

    In each ground truth, the new faces have the segment of the old face that contains them.
    """
    vertices, faces = subject.mesh.vertices, subject.mesh.faces
    for _ in range(levels):
        vertices, faces = split_in_four(vertices, faces)
    truths = tuple(np.repeat(truth, 4**levels) for truth in subject.truths)
    return Subject(Mesh(vertices, faces), truths)


def coarsened(subject: Subject) -> Subject:
    """Decimate a mesh to a quarter of its faces. This function needs PyVista and SciPy.

    In each ground truth, a new face has the segment of the old face with the nearest centroid.
    """
    import pyvista
    from scipy.spatial import KDTree

    mesh = subject.mesh
    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces.astype(int))
    decimated = surface.decimate(0.75)
    coarse = Mesh(
        np.asarray(decimated.points, dtype=np.float64),
        np.asarray(decimated.regular_faces, dtype=np.int32),
    )
    _, nearest = KDTree(_centroids(mesh)).query(_centroids(coarse))
    return Subject(coarse, tuple(truth[nearest] for truth in subject.truths))


def _centroids(mesh: Mesh) -> Floats:
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def creases(mesh: Mesh) -> tuple[Creases, Creases]:
    """Return the concave and the convex creases: edges where normals differ by at least `SHARP`."""
    faces = build_face_graph(mesh)
    measures = arc_measures(mesh, faces)
    angles = np.asarray(measures.angles)  # positive in concave edges

    def chosen(which: Bools) -> Creases:
        return Creases(faces.sources[which], faces.neighbors[which], measures.border_lengths[which])

    return chosen(angles >= SHARP), chosen(angles <= -SHARP)


SCALES: Mapping[str, Callable[[Subject], Subject]] = {
    "x1/4": coarsened,
    "x1": lambda subject: subject,
    "x4": refined,
    "x16": lambda subject: refined(subject, 2),
}
"""For each scale, a function that multiplies the number of faces of a model by the scale."""


_RECORD_VERSION = 2  # version of the content of records; other versions are not used


class Case(NamedTuple):
    """A run of one variant on one model at one scale, with k regions. Gives one row of results."""

    source: StudyMesh
    scale: str
    variant: str
    k: int

    def __str__(self) -> str:
        return f"model {self.source.name}, {self.scale}, {self.variant}, k = {self.k}"

    def item(self, folder: Path) -> WorkItem:
        """Return the work item of this case: the case, and path and key of its record.

        The path is ``folder/SCALE/MODEL/VARIANT_k-K.json``. Characters of SCALE and VARIANT other
        than letters and digits are replaced by "-".
        """
        scale, variant = (
            "".join(letter if letter.isalnum() else "-" for letter in name)
            for name in (self.scale, self.variant)
        )
        key = {
            "record": _RECORD_VERSION,
            "superfacets": __version__,
            "mesh": self.source.digest,
            "scale": self.scale,
            "variant": [self.variant, str(VARIANTS[self.variant])],
            "k": self.k,
        }
        path = folder / scale / self.source.name / f"{variant}_k-{self.k}.json"
        return WorkItem(self, path, key)


@dataclass(frozen=True)
class CaseTask:
    """Task of a worker process: measure several cases on one model at one scale."""

    items: tuple[WorkItem, ...]
    memory: int = 0

    def prepare(self) -> Callable[[WorkItem], Record]:
        """Load the model at its scale, find its creases, and return a function to measure cases."""
        first: Case = self.items[0].subject
        model = load_model(first.source)
        subject = SCALES[first.scale](Subject(model.mesh, model.ground_truths))
        surface = metrics.GroundTruths(subject.mesh, (), n_threads=1)  # reused by all cases
        areas = build_face_graph(subject.mesh).measures
        valleys, ridges = creases(subject.mesh)
        _labels(subject, first)  # warm-up, because the first call is slower

        def measure(item: WorkItem) -> Record:
            case: Case = item.subject
            start = time.process_time()  # CPU time, because wall time depends on other programs
            labels = _labels(subject, case)
            seconds = time.process_time() - start
            values = metrics.evaluate(subject.mesh, labels, surface)
            overlaps = [metrics.area_overlap(labels, truth, areas) for truth in subject.truths]
            errors = [metrics.undersegmentation_error(overlap) for overlap in overlaps]
            return {
                "model": case.source.number,
                "scale": case.scale,
                "faces": subject.mesh.n_faces,
                "variant": case.variant,
                "k": case.k,
                "ue": float(np.mean(errors)),
                "compactness": values["compactness"],
                "valleys": valleys.share_between(labels),
                "ridges": ridges.share_between(labels),
                "regions": int(values["n_regions"]),
                "extra_pieces": int(values["n_extra_pieces"]),
                "seconds": seconds,
            }

        return measure


def _labels(subject: Subject, case: Case) -> Ints:
    return segment_as(case.variant, subject.mesh, case.k, n_threads=1).labels
