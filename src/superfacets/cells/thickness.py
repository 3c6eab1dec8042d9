"""Compute the shape diameter function: the thickness of a solid, measured with rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import ArcLists, Floats
from .._validate import checked_count, checked_number, checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..mesh.faces import FaceMesh, area_vectors, cut_into_triangles
from .face_graph import FaceGraph
from .kinds import graph_and_surface, kind_of
from .surface import is_inside_out

N_RAYS = 30
"""Default number of rays per face, as in the paper of Shapira et al."""

MAX_RAYS = 10_000
"""Maximum number of rays per face. Casting 10,000 rays takes about ten milliseconds."""

MIN_DISTANCE = 1e-6
"""Minimum distance of a hit, as a fraction of the diagonal of the bounding box. Nearer hits are
ignored, because they are on the face itself or on a second face at the same position."""


def shape_diameter(
    mesh: MeshLike | CloudLike,
    *,
    smoothing: float = 0.01,
    n_rays: int = N_RAYS,
    weld: bool = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return the thickness of the solid below each face, for example to tell fingers from a palm.

    Rays start at the centroid of a face, in a cone of half-angle 60 degrees about the inward
    normal. A ray ends at the first face that it hits. It is valid if it hits this face from inside
    the solid. A face has a thickness only if at least a quarter of its rays are valid. The
    thickness s is a weighted mean of the lengths of valid rays that are within one standard
    deviation of the median length. If there are no such lengths, s is the median length. The weight
    of a ray is 1 / (angle + 0.2), with its angle to the inward normal in radians. The logarithm of
    s is then smoothed along the surface by solving :math:`(A + t^2 L)\,x = A \log s`, with areas A
    and the Laplacian L of the face graph. Arcs have the conductance :math:`\sqrt{A_i + A_j} / g`,
    where g is the distance from centroid to centroid through the midpoint of the edge.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, or mesh-like
        Same as in `segment`. The mesh may be open. The normals of a closed mesh may point inward.
    smoothing : float, default 0.01
        Smoothing length t, >= 0, as a fraction of the diagonal of the bounding box. With 0, the
        thickness is not smoothed.
    n_rays : int, default 30
        Number of rays per face, from 1 to 10,000.
    weld : bool, default True
        Same as in `segment`. The thickness is smoothed across welded edges.
    n_threads : int, optional
        Same as in `segment`. The result does not depend on the number of threads.

    Returns
    -------
    ndarray of float64, shape (N,)
        Thickness below each face, > 0, in the unit of the vertices. With smoothing, faces without a
        thickness get values from their neighbors; without smoothing, their values are NaN. With
        smoothing, too, all values are NaN in components in which no face has a thickness, such as
        single sheets and most triangle soup. For tetrahedra and points, all values are NaN.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    The run time is about a microsecond per ray.

    References
    ----------
    Shapira, Shamir and Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
    diameter function", 2008.

    Examples
    --------
    The thickness below the upper side of a slab of 20 x 20 x 1 is:

    >>> from superfacets import PolygonMesh
    >>> corners = [[x, y, z] for z in (0, 1) for y in (-10, 10) for x in (-10, 10)]
    >>> sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
    >>> slab = PolygonMesh.of_faces(corners, sides)
    >>> float(shape_diameter(slab, smoothing=0)[1].round(2))
    1.26
    """
    t = checked_number(smoothing, "smoothing", zero=True)
    n_rays = checked_count(n_rays, "n_rays", MAX_RAYS)
    threads = checked_threads(n_threads)
    cells: Any = as_cells(mesh)
    graph, surface = graph_and_surface(cells, weld, threads)
    if not kind_of(cells).has_faces:
        return np.full(surface.n_cells, np.nan)
    thickness = rays_from(cells, graph, np.arange(surface.n_cells), n_rays, threads)
    if t == 0.0:
        return thickness
    conductances = _core.step_conductances(surface.handle, graph.measures, threads)
    length = t * graph.diagonal
    # Results do not depend on the unit of length, because lengths are divided by the diagonal.
    relative = thickness / graph.diagonal
    logs = smoothed(surface.arcs, conductances, graph.measures, relative, length, threads)
    return np.asarray(graph.diagonal * np.exp(logs))


def rays_from(
    mesh: FaceMesh,
    graph: FaceGraph,
    faces: npt.NDArray[np.integer[Any]],
    n_rays: int,
    n_threads: int,
) -> Floats:
    """Return the thickness below each face in `faces`; NaN if too few of its rays are valid."""
    triangles, _ = cut_into_triangles(mesh)
    outward = area_vectors(mesh, n_threads)[faces]
    sizes = np.sqrt(np.einsum("ij,ij->i", outward, outward))
    inward = -outward / np.where(sizes > 0, sizes, 1.0)[:, np.newaxis]
    points_inward = is_inside_out(mesh, graph, n_threads=n_threads)
    return _core.ray_thickness(
        mesh.vertices,
        triangles,
        np.ascontiguousarray(graph.positions[faces]),
        -inward if points_inward else inward,
        n_rays,
        MIN_DISTANCE * graph.diagonal,
        points_inward,
        n_threads,
    )


def smoothed(
    arcs: ArcLists,
    conductances: Floats,
    measures: Floats,
    thickness: Floats,
    length: float,
    n_threads: int,
) -> Floats:
    """Return the logarithms of `thickness`, smoothed along the surface.

    `length` is the smoothing length, in the unit of the vertices. Faces with thickness NaN get
    values from their neighbors. The result is NaN in components without any finite thickness. The
    result depends neither on the number of threads nor on the C library.
    """
    is_known = np.isfinite(thickness)
    logs = _core.logarithms(np.where(is_known, thickness, 1.0))
    if length > 0:
        masses = np.where(is_known, measures, 0.0)
        logs = _core.diffuse(*arcs, conductances, masses, logs, length * length, n_threads)
    components, n_components = _core.find_components(*arcs, np.zeros(len(logs), np.int32))
    n_known = np.bincount(components, weights=is_known, minlength=n_components)
    return np.where(n_known[components] > 0, logs, np.nan)
