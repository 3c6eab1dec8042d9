"""Models with their true segments, at several resolutions, and their creases."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...cells.face_graph import build_face_graph
from ...cells.weights import superfacet_weights
from ...mesh.faces import ends_of_sides
from ...mesh.quarters import split_in_four
from ...mesh.triangle_mesh import Mesh

SHARP = math.radians(45)
"""The least angle of a crease that nobody would overlook."""


class Subject(NamedTuple):
    """A mesh, and the true segments of its faces according to several people."""

    mesh: Mesh
    truths: tuple[npt.NDArray[np.int32], ...]


class Creases(NamedTuple):
    """Sharp edges, as pairs of the faces on either side, each pair both ways around."""

    sources: npt.NDArray[np.int32]
    targets: npt.NDArray[np.int32]
    lengths: npt.NDArray[np.float64]

    def share_between(self, labels: npt.NDArray[np.int32]) -> float | None:
        """Return the share of their length that is a border between regions, if they have any."""
        total = self.lengths.sum()
        between = labels[self.sources] != labels[self.targets]
        return float(self.lengths[between].sum() / total) if total > 0 else None


def refined(subject: Subject, levels: int = 1) -> Subject:
    """Split each face into four, repeatedly; the parts keep the segment of the face."""
    vertices, faces = subject.mesh.vertices, subject.mesh.faces
    for _ in range(levels):
        vertices, faces = split_in_four(vertices, faces)
    truths = tuple(np.repeat(truth, 4**levels) for truth in subject.truths)
    return Subject(Mesh(vertices, faces), truths)


def coarsened(subject: Subject) -> Subject:
    """Decimate to a quarter of the faces.

    Each is in the segment of the old face with the nearest centroid. Needs PyVista and SciPy.
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


def _centroids(mesh: Mesh) -> npt.NDArray[np.float64]:
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def creases(mesh: Mesh) -> tuple[Creases, Creases]:
    """Return the concave and the convex edges of `SHARP` and more."""
    faces = build_face_graph(mesh)
    unit = math.pi * faces.diagonal  # with it, eq. 2 adds the angle in radians

    def angles(eta_convex: float) -> npt.NDArray[np.float64]:
        priced = superfacet_weights(
            mesh, faces, alpha=1.0, eta_convex=eta_convex, crease_length=unit
        )
        return priced - superfacet_weights(mesh, faces, alpha=0.0)

    is_concave = angles(0.0) >= SHARP
    is_convex = (angles(1.0) >= SHARP) & ~is_concave
    sources = faces.sources
    ends = mesh.vertices[ends_of_sides(mesh, sources, faces.sides)]
    lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)

    def chosen(which: npt.NDArray[np.bool_]) -> Creases:
        return Creases(sources[which], faces.neighbors[which], lengths[which])

    return chosen(is_concave), chosen(is_convex)


SCALES: Mapping[str, Callable[[Subject], Subject]] = {
    "x1/4": coarsened,
    "x1": lambda subject: subject,
    "x4": refined,
    "x16": lambda subject: refined(subject, 2),
}
"""Ways to have more or fewer faces on the same surface."""
