"""Stage 7: colors for regions, clearly different where regions touch."""

from __future__ import annotations

from functools import cache
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import checked_labels, checked_threads, compact_labels
from ..adapters.clouds import CloudLike
from ..adapters.convert import MeshLike, as_cells
from ..cells.cell_graph import CellGraph
from ..cells.face_graph import build_face_graph, find_arcs
from ..cells.point_graph import find_point_graph
from ..cells.tet_graph import build_tet_graph
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh

__all__ = ["MIN_COLOR_DISTANCE", "PALETTE", "face_colors", "region_colors", "scale_colors"]

# Colors far from each other in OKLab, found by farthest-point search with exchanges among those of
# lightness 0.68 to 0.92 (so that shading darkens them without turning them black) and a chroma of
# at most 0.12 to 0.14 (so that none glares).
PALETTE = np.array(
    [
        (255, 155, 180), (80, 160, 220), (250, 230, 115), (135, 165, 80),
        (190, 140, 220), (255, 170, 95), (165, 250, 195), (220, 115, 135),
        (170, 190, 255), (210, 135, 35), (50, 195, 180), (225, 210, 190),
        (255, 195, 255), (170, 205, 120), (185, 165, 150), (95, 230, 250),
    ],
    dtype=np.uint8,
)  # fmt: skip
"""The colors of regions, sRGB, (16, 3)."""

MIN_COLOR_DISTANCE = 0.117
"""Least distance in OKLab between two colors of the palette; 0.02 is just noticeable."""

# If possible, neighbors get colors at least this far apart (OKLab). A larger distance would leave
# too little choice: from most of its colors, half of the palette or more is this far.
_CLEAR_DISTANCE = 0.16


class _Arcs(Protocol):
    """The part of a graph that `region_colors` uses: arcs in CSR form."""

    @property
    def offsets(self) -> npt.NDArray[np.int64]: ...
    @property
    def neighbors(self) -> npt.NDArray[np.int32]: ...


def face_colors(
    mesh: MeshLike | CloudLike | CellGraph, labels: npt.ArrayLike
) -> npt.NDArray[np.uint8]:
    """Return a color for each face, by region, clearly different where regions share an edge.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like, or CellGraph
        As for `segment`; or cells of one's own.
    labels : array_like of integers, shape (F,)
        Region of each face, any numbers.

    Returns
    -------
    ndarray of uint8, shape (F, 3)
        Red, green and blue, 0 to 255, sRGB. See `region_colors` for how different they are.

    Raises
    ------
    ValueError, TypeError
        If there is not one label per face, or they are not integers.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> face_colors(square, [0, 1])
    array([[255, 155, 180],
           [ 80, 160, 220]], dtype=uint8)
    """
    if isinstance(mesh, CellGraph):
        compact, _ = compact_labels(labels, mesh.n_cells)
        return region_colors(mesh, compact)[compact]
    cells = as_cells(mesh)
    if isinstance(cells, TetMesh):
        compact, _ = compact_labels(labels, cells.n_tets)
        return region_colors(build_tet_graph(cells), compact)[compact]
    if isinstance(cells, PointCloud):
        compact, _ = compact_labels(labels, cells.n_points)
        return region_colors(find_point_graph(cells, checked_threads(None)), compact)[compact]
    mesh = cells
    compact, n_regions = compact_labels(labels, mesh.n_faces)
    if isinstance(mesh, PolygonMesh):
        return region_colors(build_face_graph(mesh), compact)[compact]
    representative = _core.weld_vertices(mesh.vertices, checked_threads(None))
    at_border = _faces_at_borders(representative[mesh.faces], compact, mesh.n_vertices)
    arcs = _arcs_between(mesh.faces[at_border], representative)
    colors = _colors_of_adjacency(*_region_adjacency(arcs, compact[at_border], n_regions))
    return colors[compact]


def region_colors(graph: _Arcs, labels: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return a color for each region, clearly different where regions touch.

    Regions are colored in the order of falling numbers of neighbors, each with the least used
    color of `PALETTE` that is far from those its neighbors have. A region that has at most 15
    neighbors when its turn comes differs from them all by at least `MIN_COLOR_DISTANCE`. Where
    neighbors have taken the whole palette, the region gets the color, of a wider choice, whose
    distance to the nearest of theirs is largest.

    The same input gives the same colors. Time and memory are linear in arcs and in pairs of
    neighboring regions.

    Parameters
    ----------
    graph : FaceGraph, CellGraph, or anything with arcs in CSR form
        ``offsets``, shape (N + 1,), and ``neighbors``, shape (M,), undirected: with both
        directions of each arc.
    labels : array_like of integers, shape (N,)
        Region of each cell, 0 to K - 1.

    Returns
    -------
    ndarray of uint8, shape (K, 3)
        Red, green and blue, 0 to 255, sRGB.

    Raises
    ------
    ValueError, TypeError
        If there is not one label per cell, or a label of 0..K-1 is missing.
    """
    checked, n_regions = checked_labels(labels, len(graph.offsets) - 1)
    arcs = (graph.offsets, graph.neighbors)
    return _colors_of_adjacency(*_region_adjacency(arcs, checked, n_regions))


def _colors_of_adjacency(
    starts: npt.NDArray[np.int64], touching: npt.NDArray[np.int64]
) -> npt.NDArray[np.uint8]:
    """Colors of regions, given those that touch each region, in CSR form."""
    order = np.argsort(-np.diff(starts), kind="stable")
    return _choices()[_color_greedily(order.tolist(), starts.tolist(), touching.tolist())]


def _faces_at_borders(
    corners: npt.NDArray[np.int32], labels: npt.NDArray[np.int32], n_vertices: int
) -> npt.NDArray[np.int64]:
    """Faces with two corners or more where regions meet: all that share an edge with another.

    Few of a large mesh do, and the graph of these takes a fraction of the time of the whole one.
    """
    some_label = np.empty(n_vertices, dtype=np.int32)  # of any of the faces at each vertex
    for vertices in corners.T:
        some_label[vertices] = labels
    is_shared = np.zeros(n_vertices, dtype=bool)
    is_shared[corners[some_label[corners] != labels[:, np.newaxis]]] = True
    first, second, third = is_shared[corners].T
    return np.flatnonzero((first & second) | (second & third) | (third & first))


def _arcs_between(
    faces: npt.NDArray[np.int32], representative: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Arcs, in CSR form, between faces that share an edge."""
    if not len(faces):
        return np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.int32)
    offsets, neighbors, *_ = find_arcs(faces, representative, checked_threads(None))
    return offsets, neighbors


def _region_adjacency(
    arcs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]],
    labels: npt.NDArray[np.int32],
    n_regions: int,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Regions that touch each region, in CSR form: starts, (K + 1,), and regions."""
    offsets, neighbors = arcs
    sources = np.repeat(labels, np.diff(offsets))
    targets = labels[neighbors]
    crossing = sources != targets
    # Not numpy.unique, which imports numpy.ma: that takes longer than all this on a small mesh.
    pairs = np.sort(sources[crossing].astype(np.int64) * n_regions + targets[crossing])
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]
    starts = np.searchsorted(pairs, np.arange(n_regions + 1) * n_regions)
    return starts.astype(np.int64), pairs % n_regions


def _color_greedily(order: list[int], starts: list[int], touching: list[int]) -> list[int]:
    """Index into `_choices` for each region. Sets of colors are the bits of an integer."""
    near, whole_palette = _near_colors(), (1 << len(PALETTE)) - 1
    colors = [-1] * len(order)  # -1: not yet colored
    n_uses = [0] * len(PALETTE)
    for region in order:
        taken = {colors[other] for other in touching[starts[region] : starts[region + 1]]} - {-1}
        close, same = 0, 0
        for color in taken:
            close |= near[color]
            same |= 1 << color
        free = (whole_palette & ~close) or (whole_palette & ~same)
        if not free:
            colors[region] = _farthest_color(sorted(taken))
            continue
        candidates = [color for color in range(len(PALETTE)) if free >> color & 1]
        color = min(candidates, key=n_uses.__getitem__)
        colors[region] = color
        n_uses[color] += 1
    return colors


def _farthest_color(taken: list[int]) -> int:
    """Index into `_choices` of the color farthest from the nearest of those taken."""
    return int(_distances()[:, taken].min(axis=1).argmax())


@cache
def _choices() -> npt.NDArray[np.uint8]:
    """Palette, then the wider choice, (C, 3): steps of 51 in each channel, nearly as light."""
    steps = np.arange(0, 256, 51)
    cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    lightness = oklab(cube)[:, 0]
    return np.concatenate([PALETTE, cube[(lightness > 0.55) & (lightness < 0.92)].astype(np.uint8)])


@cache
def _distances() -> npt.NDArray[np.float64]:
    """Distances in OKLab between all choices."""
    places = oklab(_choices())
    return np.asarray(np.linalg.norm(places[:, None] - places[None], axis=2))


@cache
def _near_colors() -> list[int]:
    """For each choice, the bits of the palette's colors that are not clearly different from it."""
    near = _distances()[:, : len(PALETTE)] < _CLEAR_DISTANCE
    return [sum(1 << int(color) for color in np.flatnonzero(row)) for row in near]


def oklab(colors: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Return sRGB colors, (N, 3), 0 to 255, in OKLab: lightness 0 to 1, green-red, blue-yellow.

    Euclidean distances are close to perceived ones. Matrices: Ottosson, "A perceptual color space
    for image processing", 2020.
    """
    scaled = np.asarray(colors, dtype=np.float64) / 255.0
    linear = np.where(scaled <= 0.04045, scaled / 12.92, ((scaled + 0.055) / 1.055) ** 2.4)
    cones = np.cbrt(linear @ _LINEAR_TO_CONES.T)
    return np.asarray(cones @ _CONES_TO_OKLAB.T)


def scale_colors(n: int = 256) -> npt.NDArray[np.uint8]:
    """Return n colors for values from low to high, (n, 3), sRGB.

    They run from dark blue over green to yellow. Lightness rises evenly: the order is seen without
    colors too.
    """
    at = np.linspace(0, len(_SCALE) - 1, n)
    places = np.stack([np.interp(at, range(len(_SCALE)), column) for column in _SCALE.T], axis=1)
    linear = (places @ np.linalg.inv(_CONES_TO_OKLAB).T) ** 3 @ np.linalg.inv(_LINEAR_TO_CONES).T
    linear = np.clip(linear, 0, 1)
    shares = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(shares * 255), np.uint8)


# In OKLab.
_SCALE = np.array(
    [
        (0.30, 0.02, -0.13), (0.46, -0.03, -0.10), (0.62, -0.10, -0.01),
        (0.78, -0.12, 0.11), (0.94, -0.03, 0.17),
    ]
)  # fmt: skip

_LINEAR_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_CONES_TO_OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
