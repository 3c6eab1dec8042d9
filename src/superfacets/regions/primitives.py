"""Stage 5: find the plane, cylinder, cone or sphere that fits each region of a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._types import Array, Bools, Floats, Ints, Longs
from .._validate import checked_number, checked_regions
from ..adapters.convert import MeshLike, as_mesh
from ..mesh.faces import cut_into_triangles

KINDS = ("plane", "cylinder", "cone", "sphere", "other")
PLANE, CYLINDER, CONE, SPHERE, OTHER = range(5)

N_PARAMETERS = (0, 5, 6, 4)
"""Degrees of freedom of each primitive. A plane counts as 0, so that one triangle is a plane."""

FACET_DEPTH = 0.05
"""Largest depth of the centroids of triangles below a curved surface, relative to its radius. On a
cylinder whose facets are two triangles each, this is the depth at 38 degrees between facets."""


BATCH_SIZE = 8192
"""Number of triangles fitted at a time, so that their arrays fit in the caches of a processor."""


@dataclass(frozen=True, eq=False)
class Primitives:
    """The primitive that fits each of K regions; the result of `fit_primitives`.

    Lengths are in the unit of the positions. Values that a primitive does not have are NaN.

    Attributes
    ----------
    kinds : ndarray of str, shape (K,)
        ``"plane"``, ``"cylinder"``, ``"cone"``, ``"sphere"``, or ``"other"`` if none of them fits.
    axes : ndarray of float64, shape (K, 3)
        Unit vector: the normal of a plane, on the side of the normals of its faces; the axis of a
        cylinder, whose component of largest absolute value is positive; the axis of a cone, from
        its apex into the cone.
    points : ndarray of float64, shape (K, 3)
        Centroid of a plane; point of the axis of a cylinder that is closest to the centroid of the
        region; apex of a cone; center of a sphere.
    radii : ndarray of float64, shape (K,)
        Radius of a cylinder or sphere; largest distance of the region from the axis of a cone.
    half_angles : ndarray of float64, shape (K,)
        Angle between the axis and the surface of a cone, in radians, from 0 to pi / 2.
    is_convex : ndarray of bool, shape (K,)
        Whether the normals of a cylinder, sphere or cone point away from its axis or center, as on
        a boss; False in a hole, and False for planes and ``"other"``.
    misfits : ndarray of float64, shape (K,)
        Root mean square distance of the vertices of the region from the primitive.
    """

    kinds: Array
    axes: Floats
    points: Floats
    radii: Floats
    half_angles: Floats
    is_convex: Bools
    misfits: Floats

    def table(self) -> dict[str, Array]:
        """Return a dict of columns, keyed by name. Each column has one value per region."""
        columns = {"primitive": self.kinds, "radius": self.radii, "half_angle": self.half_angles}
        columns |= {"is_convex": self.is_convex.astype(int), "misfit": self.misfits}
        for name, vectors in (("axis", self.axes), ("point", self.points)):
            columns |= {f"{name}_{letter}": vectors[:, i] for i, letter in enumerate("xyz")}
        return columns

    def __repr__(self) -> str:
        counts = [(np.count_nonzero(self.kinds == kind), kind) for kind in KINDS]
        return f"Primitives({', '.join(f'{n} {kind}' for n, kind in counts if n)})"


def fit_primitives(mesh: MeshLike, labels: npt.ArrayLike, *, tolerance: float = 0.01) -> Primitives:
    """Find the plane, cylinder, cone or sphere that fits each region of a mesh.

    Axes of cylinders and cones are computed from the normals of faces, and radii from vertices.
    Therefore the radius of a cylinder is exact even if it has few facets. With the default
    tolerance, neighboring facets may form angles of up to 40 degrees: a prism of nine sides is a
    cylinder, and a prism of eight sides is not.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, or mesh-like
        Same as in `segment`. Neighboring faces must have the same orientation.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks faces in no region.
    tolerance : float, default 0.01
        A primitive fits if the root mean square distance of the vertices is at most `tolerance`
        times the standard deviation of the region along its second principal axis, and the mean of
        ``1 - cos(angle)`` is at most `tolerance`, where ``angle`` is between the normals of a face
        and of the primitive (0.01: about 8 degrees). Use 0.05 for scans.

    Returns
    -------
    Primitives
        If several primitives fit, the first of plane, cylinder, cone and sphere, unless a later one
        fits twice as well.

    Raises
    ------
    MeshError
        If the mesh is not valid, or not a surface.
    ValueError, TypeError
        If labels are not one integer >= -1 per face, if a label from 0 to K - 1 is missing, or if
        `tolerance` is not positive.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> result = fit_primitives(square, [0, 0])
    >>> result, result.axes.tolist(), result.points.tolist()
    (Primitives(1 plane), [[0.0, 0.0, 1.0]], [[0.5, 0.5, 0.0]])
    """
    limit = checked_number(tolerance, "tolerance", zero=False)
    parts = [_fitted(triangles, limit) for triangles in _read(mesh, labels)]
    kinds, *values = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return Primitives(np.array(KINDS)[kinds], *values)


@dataclass(frozen=True, eq=False)
class _Triangles:
    """T triangles of K regions, in a unit in which their extent is 1."""

    regions: Ints  # (T,) region of each triangle, in ascending order
    starts: Longs  # (K,) first triangle of each region
    corners: Floats  # (T, 3, 3) positions, relative to the center of the region
    normals: Floats  # (T, 3) unit normals; 0 for triangles without area
    shares: Floats  # (T,) area of the triangle divided by the area of the region
    centers: Floats  # (K, 3) centroid of each region, in the unit of the mesh
    unit: float

    @classmethod
    def of(cls, corners: Floats, regions: Ints) -> _Triangles:
        """Convert corners (T, 3, 3) in the unit of the mesh; regions are in ascending order."""
        starts = np.flatnonzero(np.diff(regions, prepend=-1))
        origin = corners.reshape(-1, 3).min(axis=0)
        unit = float((corners.reshape(-1, 3).max(axis=0) - origin).max()) or 1.0
        corners = (corners - origin) / unit
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        normals /= np.where(areas > 0, areas, 1)[:, None]
        totals = np.add.reduceat(areas, starts)
        shares = areas / np.where(totals > 0, totals, 1)[regions]
        centers = np.add.reduceat(corners.mean(axis=1) * shares[:, None], starts)
        corners -= centers[regions][:, None]
        return cls(regions, starts, corners, normals, shares, origin + centers * unit, unit)

    def means(self, values: Floats) -> Floats:
        """Return the mean of values (T, ...) in each region, weighted by area, shape (K, ...)."""
        shares = self.shares.reshape(-1, *[1] * (values.ndim - 1))
        sums: Floats = np.add.reduceat(values * shares, self.starts)
        return sums

    def products(self, vectors: Floats, others: Floats) -> Floats:
        """Return the mean of ``v o^T`` in each region, shape (K, m, n).

        The vectors v are (T, c, m) and the others o are (T, c, n): c of each triangle.
        """
        means: Floats = self.means(vectors.transpose(0, 2, 1) @ others) / vectors.shape[1]
        return means

    @cached_property
    def spreads(self) -> Floats:
        """Mean of ``p p^T`` for the corners p of each region, shape (K, 3, 3)."""
        return self.products(self.corners, self.corners)

    @cached_property
    def normal_spreads(self) -> Floats:
        """Mean of ``n n^T`` for the normals n of each region, shape (K, 3, 3)."""
        return self.products(self.normals[:, None], self.normals[:, None])

    def counts(self) -> Floats:
        """Return the number of triangles in each region, shape (K,)."""
        return np.diff(self.starts, append=len(self.regions)).astype(float)


class _Surfaces(NamedTuple):
    """A surface of revolution for each of K regions.

    With the distance h from `points` along the axis, and the distance r from the axis, the surface
    is ``(r - radius) * cos(angle) = h * sin(angle)``. The angle is -pi / 2 for planes, and 0 for
    cylinders. The axis of a sphere is the zero vector, so that r is the distance from its center.
    """

    axes: Floats  # (K, 3)
    points: Floats  # (K, 3)
    radii: Floats  # (K,)
    angles: Floats  # (K,)

    def distances(self, regions: Ints, positions: Floats) -> tuple[Floats, Floats, Floats]:
        """Return signed distances, r, and normals of the surfaces at positions (T, c, 3)."""
        axes, angles = self.axes[regions][:, None], self.angles[regions][:, None]
        offsets = positions - self.points[regions][:, None]
        heights = (offsets * axes).sum(axis=2)
        spokes = offsets - heights[:, :, None] * axes
        r = np.sqrt((spokes**2).sum(axis=2))
        cosines, sines = np.cos(angles), np.sin(angles)
        outward = spokes / np.maximum(r, np.finfo(float).tiny)[:, :, None]
        normals = cosines[:, :, None] * outward - sines[:, :, None] * axes
        return (r - self.radii[regions][:, None]) * cosines - heights * sines, r, normals


class _Fits(NamedTuple):
    """One surface per region, and how well it fits."""

    axes: Floats  # (K, 3)
    points: Floats  # (K, 3)
    radii: Floats  # (K,) radius, or largest distance from the axis of a cone
    angles: Floats  # (K,)
    misfits: Floats  # (K,) root mean square distance of corners
    depths: Floats  # (K,) root mean square distance of the centroids of triangles
    cosines: Floats  # (K,) mean cosine between normals of triangles and surface
    curvature_radii: Floats  # (K,) mean distance along the normal from the axis; 0 for planes


def _read(mesh: MeshLike, labels: npt.ArrayLike) -> Iterator[_Triangles]:
    """Yield the triangles of labeled faces, in batches of whole regions."""
    faces = as_mesh(mesh)
    array, n_regions = checked_regions(labels, faces.n_faces, faces.n_vertices)
    indices, sources = cut_into_triangles(faces)
    regions = array if sources is None else array[sources]
    order = np.argsort(regions, kind="stable")[np.count_nonzero(regions < 0) :]
    ends = np.cumsum(np.bincount(regions[order]))
    firsts = np.flatnonzero(np.diff((ends - 1) // BATCH_SIZE, prepend=-1))
    for first, last in pairwise((*firsts, n_regions)):
        start = ends[first - 1] if first else 0
        chosen = order[start : ends[last - 1]]
        yield _Triangles.of(faces.vertices[indices[chosen]], regions[chosen] - first)


def _fitted(triangles: _Triangles, limit: float) -> tuple[Array, ...]:
    """Return the index in `KINDS` for each region, and the other attributes of `Primitives`."""
    fits = [
        _rated(triangles, surfaces(triangles))
        for surfaces in (_planes, _cylinders, _cones, _spheres)
    ]
    chosen = _chosen(triangles, fits, limit)

    def values(name: str, *kinds: int) -> Floats:
        """Return an attribute of the primitives of these kinds, and NaN for all others."""
        choices = np.stack([getattr(fit, name) for fit in fits])
        result: Floats = choices[np.minimum(chosen, SPHERE), np.arange(len(chosen))]
        result[~np.isin(chosen, kinds)] = np.nan
        return result

    unit = triangles.unit
    return (
        chosen,
        values("axes", PLANE, CYLINDER, CONE),
        triangles.centers + values("points", PLANE, CYLINDER, CONE, SPHERE) * unit,
        values("radii", CYLINDER, CONE, SPHERE) * unit,
        values("angles", CONE),
        values("cosines", CYLINDER, CONE, SPHERE) > 0,
        values("misfits", PLANE, CYLINDER, CONE, SPHERE) * unit,
    )


def _planes(triangles: _Triangles) -> _Surfaces:
    """Return the least-squares plane of the corners of each region."""
    axes = np.linalg.eigh(triangles.spreads)[1][:, :, 0]
    is_turned = np.einsum("ij,ij->i", axes, triangles.means(triangles.normals)) < 0
    axes = np.where(is_turned[:, None], -axes, axes)
    n = len(axes)
    return _Surfaces(axes, np.zeros((n, 3)), np.zeros(n), np.full(n, -np.pi / 2))


def _cylinders(triangles: _Triangles) -> _Surfaces:
    """Return cylinders with axes perpendicular to the normals, and the radius of the corners."""
    frames = np.linalg.eigh(triangles.normal_spreads)[1]
    axes, across = frames[:, :, 0], frames[:, :, 1:]
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, None], axis=1)
    centers, radii = _circles(triangles, triangles.corners @ across[triangles.regions])
    points = (across @ centers[:, :, None])[:, :, 0]
    return _Surfaces(np.where(largest < 0, -axes, axes), points, radii, np.zeros(len(axes)))


def _spheres(triangles: _Triangles) -> _Surfaces:
    """Return the least-squares sphere of the corners of each region."""
    centers, radii = _circles(triangles, triangles.corners)
    return _Surfaces(np.zeros_like(centers), centers, radii, np.zeros(len(radii)))


def _cones(triangles: _Triangles) -> _Surfaces:
    """Return cones: the axis forms one angle with all normals, and r grows linearly along it.

    The axis passes through the point that is closest to the planes of all triangles.
    """
    normals, middles = triangles.normals[:, None], triangles.corners.mean(axis=1)[:, None]
    squares, means = triangles.normal_spreads, triangles.means(triangles.normals)[:, None]
    axes = np.linalg.eigh(squares - means.transpose(0, 2, 1) @ means)[1][:, :, 0]
    heights = (normals * middles).sum(axis=2, keepdims=True)
    points = (_inverses(squares) @ triangles.products(normals, heights))[:, :, 0]
    is_turned = (axes * points).sum(axis=1) > 0  # the centers of regions are at 0
    axes = np.where(is_turned[:, None], -axes, axes)
    offsets = triangles.corners - points[triangles.regions][:, None]
    h = offsets @ axes[triangles.regions][:, :, None]
    r = np.sqrt(np.maximum((offsets**2).sum(axis=2, keepdims=True) - h**2, 0))
    ones = np.ones_like(h)
    mean_h, mean_r = triangles.products(h, ones), triangles.products(r, ones)
    variances = np.maximum(triangles.products(h, h) - mean_h**2, np.finfo(float).tiny)
    slopes = np.maximum((triangles.products(r, h) - mean_r * mean_h) / variances, 1e-6)
    points = points + axes * (mean_h - mean_r / slopes)[:, 0]
    return _Surfaces(axes, points, np.zeros(len(axes)), np.arctan(slopes).reshape(-1))


def _circles(triangles: _Triangles, corners: Floats) -> tuple[Floats, Floats]:
    """Return center and radius of the circle or sphere through corners (T, 3, n) of each region.

    This is the least-squares solution of ``2 * center . p + radius**2 - center**2 = p**2`` for the
    corners p.
    """
    rows = np.insert(2 * corners, corners.shape[2], 1, axis=2)
    squares = (corners**2).sum(axis=2, keepdims=True)
    inverses = _inverses(triangles.products(rows, rows))
    solutions = (inverses @ triangles.products(rows, squares))[:, :, 0]
    centers = solutions[:, :-1]
    return centers, np.sqrt(np.maximum(solutions[:, -1] + (centers**2).sum(axis=1), 0))


def _inverses(matrices: Floats) -> Floats:
    """Return the inverses of symmetric matrices (K, n, n); directions of no extent become 0."""
    return np.linalg.pinv(matrices, rcond=1e-12, hermitian=True).astype(np.float64, copy=False)


def _rated(triangles: _Triangles, surfaces: _Surfaces) -> _Fits:
    """Return the surfaces, and how well each of them fits its region."""
    regions, corners = triangles.regions, triangles.corners
    distances, r, _ = surfaces.distances(regions, corners)
    largest = np.maximum.reduceat(r.max(axis=1), triangles.starts)
    depths, r, normals = surfaces.distances(regions, corners.mean(axis=1)[:, None])
    return _Fits(
        surfaces.axes,
        surfaces.points,
        np.where(surfaces.radii > 0, surfaces.radii, largest),
        surfaces.angles,
        np.sqrt(triangles.means((distances**2).mean(axis=1))),
        np.sqrt(triangles.means(depths[:, 0] ** 2)),
        triangles.means((normals[:, 0] * triangles.normals).sum(axis=1)),
        triangles.means(r[:, 0]) * np.cos(surfaces.angles),
    )


def _chosen(triangles: _Triangles, fits: list[_Fits], limit: float) -> Ints:
    """Return the index in `KINDS` of the primitive of each region."""
    widths = np.sqrt(np.maximum(np.linalg.eigvalsh(triangles.spreads)[:, 1], 0))
    n_vertices = triangles.counts() + 2  # of a region without holes whose triangles are connected
    best, chosen = np.full(len(widths), np.inf), np.full(len(widths), OTHER)
    for kind, fit in enumerate(fits):
        n_free = n_vertices - N_PARAMETERS[kind]
        misfits = fit.misfits * np.sqrt(n_vertices / np.maximum(n_free, 1))
        fits_well = (n_free > 0) & (misfits <= limit * widths) & (1 - abs(fit.cosines) <= limit)
        fits_well &= fit.depths <= limit * widths + FACET_DEPTH * fit.curvature_radii
        is_better = fits_well & (best > limit / 10 * widths) & (misfits < best / 2)
        best[is_better], chosen[is_better] = misfits[is_better], kind
    return chosen
