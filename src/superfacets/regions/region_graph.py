"""Compute the region graph: measures of regions, and of the borders between neighboring regions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_choice, checked_region_centers, checked_regions, counted, freeze
from ..base.errors import import_extra
from ..base.types import Array, Bools, Floats, Ints, Longs, Singles
from ..graph.cell_graph import CellGraph
from ..graph.constraints import edge_keys, edges_of_keys
from ..graph.kinds import as_known, as_surface, fit_vertices
from ..graph.surface import Surface
from ..mesh.convert import MeshLike
from ..mesh.faces import vertex_graph
from .vertices import superpoint_cells

_ROUNDING = 1e-14
"""Variances of a region along its principal axes are treated as 0 if they are at most this fraction
of its largest variance."""

_NO_NORMAL = 1e-12
"""The sum of the area vectors of a region is treated as 0 if its length is at most this fraction of
the area of the region."""


@dataclass(frozen=True, eq=False)
class RegionGraph:
    """Graph of K regions and E pairs of neighboring regions; the result of `region_graph`.

    Lengths, areas and volumes are in the unit of the positions. For regions of tetrahedra, lengths
    of borders are areas.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each cell, from 0 to K - 1, or -1 for cells in no region.
    measures : ndarray of float64, shape (K,)
        Area of each region (estimated for points, see `build_point_graph`), or volume for
        tetrahedra.
    centroids : ndarray of float64, shape (K, 3)
        Mean position of each region, weighted by area (unweighted if a region has no area).
    normals : ndarray of float64, shape (K, 3)
        Area-weighted mean normal of each region, as a unit vector. Missing normals of
        clouds are estimated. NaN if the mean is undefined: for tetrahedra, for cells of a
        `CellGraph`, and for regions that have no area or are closed surfaces.
    normal_lengths : ndarray of float64, shape (K,)
        Length of the area-weighted mean of the unit normals of each region, from 0 (a closed
        surface, or a cylinder without its ends) to 1 (a flat region). NaN for tetrahedra, for cells
        of a `CellGraph`, and for regions without area.
    plane_normals : ndarray of float64, shape (K, 3)
        Unit normal of the least-squares plane of each region: the principal axis of the smallest of
        the ``deviations`` s0 >= s1 >= s2, independent of the normals of cells. It is on the side of
        ``normals``; where ``normals`` is NaN, its largest component by absolute value is positive.
        NaN if no plane fits best (s1 = s2), as for a line, a point, a cube or a ball.
    deviations : ndarray of float64, shape (K, 3)
        Standard deviations of each region along its three principal axes, in descending order.
        Triangles, polygons and tetrahedra are integrated exactly, so the result does not depend on
        the resolution of the mesh. Points, and cells of a `CellGraph`, are treated as point masses.
    bounds : ndarray of float64, shape (K, 2, 3)
        Minimum and maximum corner of the bounding box of each region.
    perimeters : ndarray of float64, shape (K,)
        Length of the border of each region, including its ``open_lengths``. For points, it is an
        estimate from the number of arcs that cross the border: exact on average for borders that do
        not depend on the points. Borders of `segment` run through gaps that few arcs cross, so they
        are 30 to 35% too short for points at random positions, and 20% too long on square grids.
    open_lengths : ndarray of float64, shape (K,)
        Length of each region's border on the boundary of an open mesh; 0 for point clouds.
    cell_counts : ndarray of int64, shape (K,)
        Number of cells of each region, >= 1; 0 for a superpoint without a cell.
    centers : ndarray of int32, shape (K,)
        Center of each region that `region_graph` got, or else the cell nearest to the centroid (the
        lowest of several); -1 for a superpoint without a cell.
    edge_index : ndarray of int32, shape (2, E)
        The two regions of each pair of neighbors, the lower region first. Pairs are sorted.
    border_lengths : ndarray of float64, shape (E,)
        Length of the common border of each pair of neighbors.
    mean_angles : ndarray of float64, shape (E,)
        Mean angle between normals along each border, weighted by length, from 0 (flat) to pi.
    max_angles : ndarray of float64, shape (E,)
        Signed angle with the largest absolute value along each border, from -pi to pi, positive if
        concave and negative if convex.
    concavities : ndarray of float64, shape (E,)
        Mean signed angle along each border, weighted by length, from -pi to pi: positive in a
        concave crease, negative on a convex edge, and 0 if the surface is flat.
    edge_counts : ndarray of int64, shape (E,)
        Number of edges (triangles for tetrahedra, pairs of points for clouds) of each border.
    dimension : int
        2 if measures are areas, 3 if they are volumes.
    """

    labels: Ints
    measures: Floats
    centroids: Floats
    normals: Floats
    normal_lengths: Floats
    plane_normals: Floats
    deviations: Floats
    bounds: Floats
    perimeters: Floats
    open_lengths: Floats
    cell_counts: Longs
    centers: Ints
    edge_index: Ints
    border_lengths: Floats
    mean_angles: Floats
    max_angles: Floats
    concavities: Floats
    edge_counts: Longs
    dimension: int = 2

    ARC_VALUES: ClassVar[tuple[str, ...]] = (
        "border_length", "mean_angle", "max_angle", "concavity", "edge_count", "normal_angle",
    )  # fmt: skip
    """Names of the measures of pairs of neighbors, in the order of the columns of ``edge_attr`` in
    the result of `to_pyg`."""

    REGION_FEATURES: ClassVar[tuple[str, ...]] = (
        "measure", "perimeter", "compactness", "linearity", "planarity", "sphericity",
        "surface_variation", "normal_x", "normal_y", "normal_z",
    )  # fmt: skip
    """Names of the columns of ``x`` in the result of `to_pyg`."""

    @classmethod
    def of_surface(cls, surface: Surface, labels: npt.ArrayLike) -> RegionGraph:
        """Return the result of `region_graph` for cells whose `Surface` is known."""
        return region_graph_of(surface, *checked_regions(labels, surface.n_cells))

    @property
    def n_regions(self) -> int:
        """Number of regions, K."""
        return len(self.measures)

    @property
    def n_arcs(self) -> int:
        """Number of pairs of neighbors, E."""
        return len(self.border_lengths)

    @property
    def areas(self) -> Floats:
        """Area of each region, shape (K,). Raises a ValueError for regions of tetrahedra."""
        if self.dimension != 2:
            raise ValueError("regions of tetrahedra have volumes, not areas: use `measures`")
        return self.measures

    @property
    def linearity(self) -> Floats:
        """(s0 - s1) / s0 for the `deviations` s0, s1, s2, shape (K,).

        The value is 1 for a line, and NaN for a point. The sum of `linearity`, `planarity` and
        `sphericity` is 1. As in superpoint networks, these numbers are computed from standard
        deviations, not from variances.
        """
        first, second, _ = self.deviations.T
        return _ratio(first - second, first)

    @property
    def planarity(self) -> Floats:
        """(s1 - s2) / s0 for the `deviations` s0, s1, s2, shape (K,).

        The value is 1 for a disk, low for a long flat region, and NaN for a point. To find flat
        regions, use `surface_variation`.
        """
        first, second, third = self.deviations.T
        return _ratio(second - third, first)

    @property
    def sphericity(self) -> Floats:
        """s2 / s0 for the `deviations` s0, s1, s2, shape (K,).

        Also called scattering. It is 1 for a ball, 0 for a flat region, and NaN for a point.
        """
        return _ratio(self.deviations[:, 2], self.deviations[:, 0])

    @property
    def surface_variation(self) -> Floats:
        """s2 / (s0 + s1 + s2) for the `deviations` s0, s1, s2, shape (K,).

        The value is 0 for a flat region, 1/3 for a ball, and NaN for a point. Pauly, Gross and
        Kobbelt (2002) define it with variances. It has no unit, and is not a curvature 1/r.
        """
        return _ratio(self.deviations[:, 2], self.deviations.sum(axis=1))

    @property
    def compactness(self) -> Floats:
        """Perimeter / sqrt(area) of each region, shape (K,), as in `metrics.compactness`.

        For tetrahedra, the value is surface / volume^(2/3). The value is NaN for a region without
        area or volume.
        """
        return _ratio(self.perimeters, self.measures ** ((self.dimension - 1) / self.dimension))

    @property
    def normal_angles(self) -> Floats:
        """Angle between the `normals` of the two regions of each pair, shape (E,), from 0 to pi.

        The value is 0 for coplanar regions, and NaN if a normal is undefined. Unlike
        ``mean_angles``, it hardly depends on the noise and the cells along the border.
        """
        low, high = self.normals[self.edge_index]
        # Unlike acos of the dot product, this is accurate near 0 and pi.
        sines, cosines = np.linalg.norm(high - low, axis=1), np.linalg.norm(high + low, axis=1)
        return np.asarray(2.0 * np.arctan2(sines, cosines))

    @property
    def neighbor_counts(self) -> Longs:
        """Number of neighboring regions of each region, shape (K,)."""
        return np.bincount(self.edge_index.ravel(), minlength=self.n_regions)

    @property
    def is_open(self) -> Bools:
        """Whether part of the border of each region is on the boundary of an open mesh, (K,)."""
        return self.open_lengths > 0

    def neighbors(self, region: int) -> Ints:
        """Return the neighboring regions of `region`, in ascending order.

        Raises an IndexError if `region` is not from 0 to K - 1.
        """
        if not 0 <= region < self.n_regions:
            raise IndexError(f"region must be 0 to {self.n_regions - 1}, got {region}")
        offsets, targets, _ = self._both_ways
        return targets[offsets[region] : offsets[region + 1]].copy()

    @cached_property
    def _both_ways(self) -> tuple[Longs, Ints, Longs]:
        """Offsets (K + 1,), targets and pairs of arcs in both directions between neighbors."""
        sources, targets = np.concatenate([self.edge_index, self.edge_index[::-1]], axis=1)
        order = np.lexsort((targets, sources))
        offsets = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=self.n_regions))])
        return offsets, targets[order], order % max(self.n_arcs, 1)

    def arc_values(self, name: str) -> Array:
        """Return the measure `name`, one of `ARC_VALUES`, of each pair of neighbors, shape (E,)."""
        checked_choice(name, "value", self.ARC_VALUES)
        values: Array = getattr(self, "concavities" if name == "concavity" else f"{name}s")
        return values

    @staticmethod
    def column_names(dimension: int) -> tuple[str, ...]:
        """Return the names of the columns of `table`, given `dimension` (2 or 3)."""
        return (
            "region", "cell_count", "area" if dimension == 2 else "volume", "perimeter",
            "open_length", "neighbor_count", "center", "centroid_x", "centroid_y", "centroid_z",
            "normal_x", "normal_y", "normal_z", "normal_length", "plane_normal_x",
            "plane_normal_y", "plane_normal_z", "linearity", "planarity", "sphericity",
            "surface_variation", "compactness", "low_x", "low_y", "low_z", "high_x", "high_y",
            "high_z",
        )  # fmt: skip

    def table(self) -> dict[str, Array]:
        """Return a dict of columns, keyed by name. Each column has one value per region.

        For tetrahedra, the column ``"area"`` is called ``"volume"``.
        """
        low, high = self.bounds[:, 0], self.bounds[:, 1]
        columns = (
            np.arange(self.n_regions), self.cell_counts, self.measures, self.perimeters,
            self.open_lengths, self.neighbor_counts, self.centers, *self.centroids.T,
            *self.normals.T, self.normal_lengths, *self.plane_normals.T, self.linearity,
            self.planarity, self.sphericity, self.surface_variation, self.compactness, *low.T,
            *high.T,
        )  # fmt: skip
        return dict(zip(self.column_names(self.dimension), columns, strict=True))

    def to_pandas(self) -> Any:
        """Return the columns of `table` as a pandas DataFrame, indexed by region.

        Raises
        ------
        MissingExtraError
            If pandas is not installed.
        """
        pandas = import_extra("pandas", "a table of regions", "graph")
        return pandas.DataFrame(self.table()).set_index("region")

    def to_networkx(self) -> Any:
        """Return a ``networkx.Graph`` of regions, with measures of regions and of borders.

        Nodes are 0 to K - 1. Their attributes are the columns of `table`, except ``"region"``. The
        attributes of edges are the measures in `ARC_VALUES`, and ``"weight"``, the length of the
        border, which networkx uses, for example in ``pagerank``. All values are Python numbers.

        Raises
        ------
        MissingExtraError
            If networkx is not installed.
        """
        graph = import_extra("networkx", "a graph of regions", "graph").Graph()
        columns = self.table()
        del columns["region"]
        graph.add_nodes_from(enumerate(_rows(columns)))
        values = {name: self.arc_values(name) for name in self.ARC_VALUES}
        arcs = _rows(values | {"weight": self.border_lengths})
        graph.add_edges_from(zip(*self.edge_index.tolist(), arcs, strict=True))
        return graph

    def to_scipy(self, value: str = "border_length") -> Any:
        """Return the symmetric adjacency matrix of regions as a sparse ``csr_array`` (K, K).

        Parameters
        ----------
        value : str, default "border_length"
            Name of the measure in the matrix, from `ARC_VALUES`; the default is also the
            ``"weight"`` in `to_networkx`. Zeros are stored explicitly.

        Raises
        ------
        ValueError
            If `value` is not in `ARC_VALUES`.
        MissingExtraError
            If SciPy is not installed.
        """
        values = self.arc_values(value)
        sparse = import_extra("scipy.sparse", "a sparse matrix of regions", "graph")
        offsets, targets, arcs = self._both_ways
        shape = (self.n_regions, self.n_regions)
        # SciPy 1.11 does not find the connected components of graphs with int64 offsets.
        structure = targets.copy(), offsets.astype(np.int32)  # the matrix can be changed in place
        return sparse.csr_array((values[arcs], *structure), shape=shape)

    def to_pyg(self) -> dict[str, Array]:
        """Return the arrays of a PyTorch Geometric graph of the regions, keyed by name.

        ``Data(**{name: torch.from_numpy(array) for name, array in graph.to_pyg().items()})`` makes
        the graph. ``np.savez(path, **graph.to_pyg())`` saves the arrays.

        Returns
        -------
        dict of str to ndarray
            - ``edge_index``, (2, 2 E) int64: pairs of neighbors in both directions, sorted.
            - ``edge_attr``, (2 E, 6) float32: the measures in `ARC_VALUES` of each pair, with 0 in
              place of NaN.
            - ``pos``, (K, 3) float32: the centroids of regions.
            - ``x``, (K, 10) float32: the values in `REGION_FEATURES`, with 0 in place of NaN.
            - ``super_index``, (N,) int64: the region of each cell, or -1 for cells in no region.

            Numbers that are too large for float32 become infinite.
        """
        offsets, targets, arcs = self._both_ways
        sources = np.repeat(np.arange(self.n_regions), np.diff(offsets))
        edge_attr = np.stack([self.arc_values(name) for name in self.ARC_VALUES], axis=1)
        columns = {"measure": self.measures} | self.table()
        x = np.stack([columns[name] for name in self.REGION_FEATURES], axis=1)
        return {
            "edge_index": np.stack([sources, targets]).astype(np.int64),
            "edge_attr": _float32(np.where(np.isnan(edge_attr), 0.0, edge_attr)[arcs]),
            "pos": _float32(self.centroids),
            "x": _float32(np.where(np.isnan(x), 0.0, x)),
            "super_index": self.labels.astype(np.int64),
        }

    def __repr__(self) -> str:
        return (
            f"RegionGraph({counted(self.n_regions, 'region')}, {counted(self.n_arcs, 'pair')}; "
            ".to_pandas(), .to_networkx(), .to_scipy(), .to_pyg())"
        )


def region_graph(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, centers: npt.ArrayLike | None = None,
    weld: float = True, n_threads: int | None = None,
) -> RegionGraph:  # fmt: skip
    """Return the graph of regions, with measures of regions and of borders between neighbors.

    For a result of `segment`, use its attribute ``regions`` instead.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph of any cells.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks cells in no region. If
        there is one label per vertex (superpoints), (V,), instead of one per cell, region i
        consists of the cells to which `face_labels` gives label i. A superpoint without cells takes
        a cell that it touches, or else has area 0, and the mean of its vertices.
    centers : array_like of int, shape (K,), optional
        Representative cell of each region. The default is the cell nearest to the centroid.
    weld, n_threads
        Same as in `segment`. The result does not depend on `n_threads`.

    Returns
    -------
    RegionGraph

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If labels are not one integer >= -1 per cell, if a label from 0 to K - 1 is missing, or if
        all labels are -1. If centers are not one cell of each region. If the cells are a
        `CellGraph` without `ArcMeasures`.

    Notes
    -----
    Time is O(N + M + B log B) for M arcs, of which B cross borders. A border to cells in no region
    is part of the perimeter, but not of ``edge_index``; points in no region are left out. An edge
    of three or more faces counts once for each pair of regions at the edge, with the mean of the
    angles between their faces. Superpoints are neighbors if an edge of the mesh connects them; if
    their cells have no common border, the length of the border is 0, and its angles are NaN.

    Examples
    --------
    A square of two triangles is folded along its diagonal by 90 degrees, to a valley:

    >>> valley = ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> graph = region_graph(valley, [0, 1])
    >>> graph.n_regions, graph.areas.tolist(), graph.edge_index.tolist()
    (2, [0.5, 0.5], [[0], [1]])
    >>> graph.border_lengths.tolist(), graph.concavities.round(3).tolist()
    ([1.0], [1.571])
    """
    known = as_known(mesh)
    if fit_vertices(labels, known):
        return superpoint_graph(known, labels, centers=centers, weld=weld, n_threads=n_threads)
    n_vertices = getattr(known, "n_vertices", None)
    advice = "; or pass labels of vertices to superfacets.region_graph, which keeps the numbers"
    advice = "" if n_vertices is None else advice
    array, n_regions = checked_regions(labels, known.n_cells, n_vertices, advice=advice)
    surface = as_surface(known, weld=weld, n_threads=n_threads, is_kept=array >= 0)
    given = None if centers is None else checked_region_centers(centers, array, n_regions)
    return region_graph_of(surface, array, n_regions, given)


def superpoint_graph(cells: Any, superpoints: npt.ArrayLike, **options: Any) -> RegionGraph:
    """Return the result of `region_graph` for one label per vertex of a mesh."""
    array, _ = checked_regions(superpoints, cells.n_vertices, noun="vertex")
    whole, labels = superpoint_cells(cells, array)
    graph = region_graph(whole, labels, **options)
    if whole is not cells:
        own = graph.labels[: cells.n_cells]
        counts = np.bincount(own + np.int32(1), minlength=graph.n_regions + 1)[1:]
        centers = np.where(graph.centers < cells.n_cells, graph.centers, np.int32(-1))
        freeze(graph, labels=own, cell_counts=counts, centers=centers)
    edges = vertex_graph(cells, np.arange(len(array), dtype=np.int32), 1)
    ends = np.stack([np.repeat(array, np.diff(edges.offsets)), array[edges.neighbors]])
    pairs = np.append(graph.edge_index, ends[:, (ends[0] >= 0) & (ends[0] < ends[1])], axis=1)
    keys, places = np.unique(edge_keys(pairs.T), return_index=True)
    places = np.minimum(places, graph.n_arcs)  # index of the value of pairs without a border
    angles = ("mean_angles", "max_angles", "concavities")
    values = {"border_lengths": 0, "edge_counts": 0} | dict.fromkeys(angles, np.nan)
    arcs = {name: np.append(getattr(graph, name), values[name])[places] for name in values}
    freeze(graph, edge_index=np.ascontiguousarray(edges_of_keys(keys).T), **arcs)
    return graph


def region_graph_of(
    surface: Surface, labels: Ints, n_regions: int, centers: Ints | None = None
) -> RegionGraph:
    """Return the result of `region_graph` for labels and centers that are already checked."""
    handle, n_threads = surface.handle, surface.n_threads
    measures, centroids, squares, products, normal_sums, lows, highs, open_lengths, nearest = (
        _core.measure_regions(handle, labels, n_regions, n_threads)
    )
    low, high, border_lengths, mean_angles, concavities, max_angles, edge_counts = (
        _core.region_arcs(handle, labels, n_threads)
    )
    normals, normal_lengths = _normals_of(normal_sums, measures, surface)
    variances, axes = _principal_axes(squares, products)
    arrays: dict[str, Array] = {
        "labels": labels, "measures": measures, "centroids": centroids, "normals": normals,
        "normal_lengths": normal_lengths,
        "plane_normals": _plane_normals(variances, axes[:, 2], normals),
        "deviations": np.sqrt(variances), "bounds": np.stack([lows, highs], axis=1),
        "perimeters": _core.region_perimeters(handle, labels, n_regions, n_threads),
        "open_lengths": open_lengths,
        "cell_counts": np.bincount(labels + np.int32(1), minlength=n_regions + 1)[1:],
        "centers": nearest if centers is None else centers, "edge_index": np.stack([low, high]),
        "border_lengths": border_lengths, "mean_angles": mean_angles, "max_angles": max_angles,
        "concavities": concavities, "edge_counts": edge_counts,
    }  # fmt: skip
    graph = RegionGraph(**arrays, dimension=surface.dimension)
    freeze(graph, **arrays)
    return graph


def _principal_axes(squares: Floats, products: Floats) -> tuple[Floats, Floats]:
    """Return eigenvalues, (K, 3) descending, and eigenvectors, (K, 3, 3) rows, of covariances."""
    xx, yy, zz = squares.T
    xy, xz, yz = products.T
    covariances = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
    variances, axes = np.linalg.eigh(covariances)
    variances = variances[:, ::-1]
    is_real = variances > _ROUNDING * variances[:, :1]
    return np.where(is_real, variances, 0.0), axes[:, :, ::-1].transpose(0, 2, 1)


def _plane_normals(variances: Floats, axes: Floats, normals: Floats) -> Floats:
    """Flip `axes`, (K, 3), toward `normals`, or where these are NaN, toward positive numbers.

    Axes become NaN where the two smaller `variances` are equal.
    """
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, np.newaxis], axis=1)[:, 0]
    toward = np.einsum("ij,ij->i", axes, normals)
    signs = np.where(np.where(np.isnan(toward), largest, toward) < 0.0, -1.0, 1.0)
    first, second, third = variances.T
    signs[second - third <= _ROUNDING * first] = np.nan
    turned: Floats = axes * signs[:, np.newaxis]
    return turned


def _normals_of(sums: Floats, measures: Floats, surface: Surface) -> tuple[Floats, Floats]:
    """Return directions of sums of area vectors, and lengths per area; NaN if undefined."""
    lengths = np.sqrt(np.einsum("ij,ij->i", sums, sums))
    units = sums / np.where(lengths <= _NO_NORMAL * measures, np.nan, lengths)[:, np.newaxis]
    if surface.mesh is None and not sums.any():  # only faces always have normals
        return units, np.full(len(sums), np.nan)
    return units, np.minimum(_ratio(lengths, measures), 1.0)


def _ratio(above: Floats, below: Floats) -> Floats:
    """Return `above` / `below`, or NaN where `below` is 0."""
    quotients: Floats = np.full(len(below), np.nan)
    np.divide(above, below, out=quotients, where=below > 0)
    return quotients


def _float32(values: Array) -> Singles:
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _rows(columns: dict[str, Array]) -> list[dict[str, Any]]:
    """Convert a table from a dict of columns to a list of rows; a row maps names to numbers."""
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in values]
