"""Cut faces along smooth borders of regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_regions, checked_threads, counted, freeze
from ..base.errors import MeshError
from ..base.types import Bools, Bytes, Floats, Ints, Longs
from ..graph.face_graph import build_face_graph
from ..graph.sums import sums_by_label
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import cut_into_triangles
from ..mesh.meshes import Mesh
from ..mesh.weld import lowest_vertices

_N_ROUNDS = 7
"""Number of smoothing rounds. On 16 benchmark models, the mean `metrics.compactness` is 4.41 before
smoothing, and 4.18, 4.09 and 4.07 after 1, 5 and 7 rounds (lower is better). More rounds would
hardly improve the compactness, but would move borders farther from their original position."""

_N_STEPS = 6
"""Number of diffusion steps per smoothing round. The mean compactness (lower is better) is 4.10
with 4 steps, and 4.07 with 6 steps. With more than 6 steps, small regions vanish."""

_N_BALANCES = 6
"""Number of corrections per smoothing round that restore the areas of regions. With 6 corrections,
the area changes of all regions sum to 0.3 % of the total area."""

_MARGIN = 0.1
"""Minimum distance between the point where an edge is cut and both ends of the edge, as a fraction
of the edge length. With a value of 0.01, the compactness is 0.3 % better, but new faces are
thinner."""

_MAX_CHANGE = 0.15
"""Maximum change of the area of a region, relative to its area. Regions whose area would change
more keep their old faces: 7 of 150 regions with this limit, and 12 of 150 with a limit of 0.05."""

_MAX_TOTAL = 0.01
"""Maximum sum of the area changes of all regions, as a fraction of the area of the mesh."""

_MAX_TRIALS = 12
"""Maximum number of attempts to cut the faces; see `_cut_until_sound`. If all attempts fail, all
regions keep their old faces. Most models need 3 to 5 attempts."""


@dataclass(frozen=True, eq=False)
class BorderCut:
    """Result of `cut_borders`: a mesh with faces cut along smooth borders of regions.

    Attributes
    ----------
    mesh : Mesh
        Vertices are the old vertices in their order, followed by the new vertices. Faces are the
        parts of old face 0, of old face 1, and so on, with the orientation of the old face.
    labels : ndarray of int32, shape (F',)
        Region of each new face, or -1 if the face is in no region.
    sources : ndarray of int32, shape (F',)
        Index of the old face that contains each new face. These indices are in ascending order.
        ``values[sources]`` maps values of old faces to new faces.
    n_old_vertices : int
        Number of vertices of the old mesh.
    is_kept : ndarray of bool, shape (K,)
        Whether each region keeps its old faces. A region keeps its old faces if smooth borders
        would remove it, disconnect it or change its area too much. Neighbors of such a region may
        keep their old faces, too.
    """

    mesh: Mesh
    labels: Ints
    sources: Ints
    n_old_vertices: int
    is_kept: Bools

    def __post_init__(self) -> None:
        freeze(self, labels=self.labels, sources=self.sources, is_kept=self.is_kept)

    @property
    def n_sources(self) -> int:
        """Number of faces of the old mesh."""
        return int(self.sources[-1]) + 1

    def __repr__(self) -> str:
        return f"BorderCut({counted(self.n_sources, 'face')} into {len(self.sources)})"


def cut_borders(
    mesh: MeshLike, labels: npt.ArrayLike, *, weld: float = True, n_threads: int | None = None
) -> BorderCut:
    """Cut faces along smooth borders between regions, and return the new mesh and its labels.

    The zigzag of borders along edges becomes smooth curves, for texture charts, cut-out patterns,
    printing and pictures. `smooth_borders` changes only labels and keeps the mesh.

    Borders in creases and on the boundary of an open mesh do not move. Creases are folds of 75
    degrees or more, folds of 40 degrees or more that continue almost straight, and edges of three
    or more faces. The area of each region changes by at most 15 %, and the sum of all changes is at
    most 1 % of the total area. Connected regions stay connected. A region for which smooth borders
    would violate these rules keeps its faces; see `BorderCut.is_kept`.

    All faces at an edge are cut at the same point, so closed meshes stay closed, and seams get no
    gaps. This point is at least a tenth of the edge length away from both ends. A face is cut into
    at most six parts, which may be slivers.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`, but the mesh must have faces. Polygons are triangulated first.
    labels : array_like of int, shape (F,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks faces in no region.
        A border between a region and faces in no region is also smoothed.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    BorderCut
        The new mesh; for each new face, its region and the old face that contains it.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, if the new mesh would have too many faces, if
        labels are not one integer >= -1 per face, if a label from 0 to K - 1 is missing, or if all
        labels are -1.

    Notes
    -----
    Time is O(F). The curves are computed by threshold dynamics with fixed areas: the indicator
    function of each region diffuses along the surface, but not across creases; an offset per
    region, which keeps its area, is added; and each point goes to the region with the largest sum.

    References
    ----------
    Merriman, Bence and Osher, "Diffusion generated motion by mean curvature", 1992; Jacobs,
    Merkurjev and Esedoglu, "Auction dynamics: a volume constrained MBO scheme", 2018.

    Examples
    --------
    In this grid of squares, the border between the two regions has a corner in the middle:

    >>> vertices = [[x, y, 0] for y in range(3) for x in range(4)]
    >>> quads = [(v, v + 1, v + 5, v + 4) for v in (0, 1, 2, 4, 5, 6)]
    >>> mesh = (vertices, [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])
    >>> cut = cut_borders(mesh, [0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1])
    >>> cut.mesh.n_faces > 12, cut.n_old_vertices
    (True, 12)
    """
    surface = as_mesh(mesh)
    threads = checked_threads(n_threads)
    array, n_regions = checked_regions(labels, surface.n_faces, surface.n_vertices)
    triangles, polygons = cut_into_triangles(surface)
    old = Mesh(surface.vertices, triangles)
    of_triangles = array if polygons is None else np.ascontiguousarray(array[polygons])
    cut, is_kept = _cut_until_sound(_RegionsToCut.of(old, of_triangles, n_regions, weld, threads))
    vertices, faces, new_labels, sources = cut
    sources = sources if polygons is None else polygons[sources].astype(np.int32)
    new_labels[new_labels == n_regions] = -1
    return BorderCut(Mesh(vertices, faces), new_labels, sources, surface.n_vertices, is_kept)


_Cut = tuple[Floats, Ints, Ints, Ints]
"""Vertices and faces of a cut mesh, and the label and the old face of each of its faces."""


@dataclass(frozen=True, eq=False)
class _RegionsToCut:
    """Regions whose faces are cut. All faces in no region together form one additional region."""

    mesh: Mesh
    labels: Ints  # (F,) region of each face, or n_regions if the face is in no region
    n_regions: int  # number of regions, not counting the additional region
    representative: Ints  # (V,) lowest index of a vertex at the same position
    weld: float  # whether vertices at the same position are treated as one vertex
    areas: Floats  # (n_regions + 1,) area of each region
    n_pieces: Longs  # (n_regions + 1,) number of connected components of each region
    n_threads: int

    @classmethod
    def of(
        cls, mesh: Mesh, labels: Ints, n_regions: int, weld: float, n_threads: int
    ) -> _RegionsToCut:
        """Prepare regions for cutting. `labels` must be checked; -1 marks faces in no region."""
        whole = np.where(labels < 0, n_regions, labels).astype(np.int32)
        lowest = lowest_vertices(mesh.vertices, weld, n_threads)
        areas = _core.measure_faces(mesh.vertices, mesh.faces, n_threads)[1]
        sums = sums_by_label(whole, areas, n_regions + 1)
        pieces = _count_pieces(mesh, whole, n_regions + 1, weld, n_threads)
        return cls(mesh, whole, n_regions, lowest, weld, sums, pieces, n_threads)

    def cut(self, is_kept: Bytes) -> _Cut:
        """Cut faces along smooth borders, except faces of regions for which `is_kept` is 1."""
        try:
            return _core.cut_borders(
                self.mesh.vertices, self.mesh.faces, self.representative, self.labels,
                self.n_regions + 1, np.ascontiguousarray(is_kept[self.labels]), n_rounds=_N_ROUNDS,
                n_steps=_N_STEPS, n_balances=_N_BALANCES, margin=_MARGIN, n_threads=self.n_threads,
            )  # fmt: skip
        except ValueError:  # `_core` raises this error for too many faces
            raise MeshError("the cut mesh would have too many faces for 32-bit indices") from None

    def faults(self, cut: _Cut) -> Bools:
        """Return which regions vanished, fell apart or changed their area too much, (n + 1,)."""
        vertices, faces, labels, _ = cut
        n = self.n_regions + 1
        new = Mesh(vertices, faces)
        areas = _core.measure_faces(new.vertices, new.faces, self.n_threads)[1]
        change = np.abs(sums_by_label(labels, areas, n) - self.areas)
        # The largest change, up to which all changes sum to at most `_MAX_TOTAL` of the total area.
        ascending = np.sort(change)
        n_small = np.searchsorted(np.cumsum(ascending), _MAX_TOTAL * self.areas.sum(), "right")
        largest = np.inf if n_small == n else float(ascending[max(n_small - 1, 0)])
        limit = np.minimum(_MAX_CHANGE * self.areas, largest)
        pieces = _count_pieces(new, labels, n, self.weld, self.n_threads)
        has_vanished = (pieces == 0) & (self.n_pieces > 0)
        return np.asarray(has_vanished | (pieces > self.n_pieces) | (change > limit))

    def with_neighbors(self, is_chosen: Bools) -> Bools:
        """Return whether each region is chosen, or has a common vertex with a chosen region."""
        corners = self.representative[self.mesh.faces]
        is_touched = np.zeros(self.mesh.n_vertices, dtype=bool)
        is_touched[corners[is_chosen[self.labels]]] = True
        touching = np.zeros(self.n_regions + 1, dtype=bool)
        touching[self.labels[is_touched[corners].any(axis=1)]] = True
        return touching


def _cut_until_sound(regions: _RegionsToCut) -> tuple[_Cut, Bools]:
    """Cut faces until no region has a fault; return the cut, and which regions stay uncut."""
    is_kept = np.zeros(regions.n_regions + 1, dtype=bool)
    for trial in range(_MAX_TRIALS):
        cut = regions.cut(is_kept.view(np.uint8))
        faults = regions.faults(cut)
        if not faults.any():
            return cut, is_kept[:-1]
        is_kept |= faults
        if trial >= _MAX_TRIALS // 2:
            is_kept = regions.with_neighbors(is_kept)
    is_kept[:] = True
    return regions.cut(is_kept.view(np.uint8)), is_kept[:-1]


def _count_pieces(mesh: Mesh, labels: Ints, n_labels: int, weld: float, n_threads: int) -> Longs:
    """Return the number of connected components of the faces with each label, (n_labels,)."""
    graph = build_face_graph(mesh, weld=weld, n_threads=n_threads)
    pieces, n_pieces = _core.find_components(graph.offsets, graph.neighbors, labels)
    of_piece = np.empty(n_pieces, dtype=np.int32)
    of_piece[pieces] = labels
    return np.bincount(of_piece, minlength=n_labels)
