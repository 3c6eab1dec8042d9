"""Stage 2: one length per arc, from the geometry of its two faces."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Bytes, Floats
from .._validate import checked_choice, checked_number, checked_share, checked_threads
from ..adapters.convert import MeshLike, as_mesh
from .cell_graph import Arcs
from .face_graph import FaceGraph
from .surface import Surface, face_surface

SOLID = 0.3
"""Smallest roundness y of a solid shape. Convex bodies have at most 1, and long rods have 3/4."""

HOLLOW = 0.15
"""Largest roundness y of a fully hollow shape. Insides and outsides of thin walls cancel out."""

MOST_EVENED = 0.25
"""Largest share s in `crease_weights`: the cost of smooth convex edges of fully hollow shapes."""

STEPS = 1 << 16
"""Shares are rounded to multiples of 1 / `STEPS`, to hide rounding errors."""

TURN_BITS = 31
"""The core sums length times angle in units of about the diagonal / 2**`TURN_BITS`."""


def evened_share(turn: int, volume: float, area: float, diagonal: float) -> float:
    """Return the share s of `crease_weights`: 0 for solid shapes to `MOST_EVENED` for hollow ones.

    `turn` is the sum over edges of length times angle, in the unit of the core; `volume` is the
    enclosed volume, 0 for an open mesh.
    """
    if not volume or not area:
        return 0.0
    unit = math.ldexp(1.0, math.frexp(diagonal)[1] - 1 - TURN_BITS)
    roundness = 3.0 * volume * (turn * unit / 2.0) / area**2
    share = min(max((SOLID - roundness) / (SOLID - HOLLOW), 0.0), 1.0)
    return MOST_EVENED * round(STEPS * share) / STEPS


UNKNOWN_TURN = 0.5
"""Weight of convex creases if the inside of a surface is unknown. With this value, 1.5 % of the
points of a synthetic room without normals are in a region of another surface; with 0, 8.5 %; with
1, 1.4 %."""

NO_NORMALS = np.empty((0, 3))
"""Argument for the core: no normals given, the core computes them."""

MOST_SOFT = 2
"""Largest ratio of soft edges (10.4 to 40 degrees) to sharp edges in machine parts. The ratio is at
most 1.3 for machine parts of the benchmark, and at least 3.4 for other models with sharp edges."""

RIM_FACTOR = 2.0
"""Factor of the weight `ridges` on machine parts. With 1, borders of regions miss up to 2 % of the
rims at some numbers of regions."""

RIM_TURN = 59 / 180
"""Coarse cells of machine parts do not extend across ridges with at least this turn, in multiples
of pi. Otherwise faces narrower than a coarse cell would get no region. The turn is just below 60
degrees, because edges of a hexagonal prism turn by 60 degrees, plus or minus rounding errors."""

ALL_COUNT = np.empty(0, np.uint8)
"""Argument for the core: all arcs count."""


WeightName = Literal["parts", "creases", "superfacets", "stk02"]

Weights: TypeAlias = Sequence[float] | npt.NDArray[np.floating[Any] | np.integer[Any]]
"""One weight per arc."""

CellArrays = tuple[Floats, Floats, Floats]
"""Positions, measures, and unit normals or `NO_NORMALS`."""


class EdgeFactors(NamedTuple):
    """Costs of edges: arguments of kernels."""

    alpha: float
    eta_convex: float
    crease_length: float  # 0: the length of each edge
    ridges: float = 0.0
    is_straight: bool = False  # steps lead straight from centroid to centroid
    evened: float = 0.0  # cost of smooth convex edges; smooth concave edges cost 1 - evened
    all_sharp: bool = False  # all sharp convex edges are ridges
    slack: float = 0.0  # angle subtracted from each angle: edges that bend by less are free

    @classmethod
    def of_radius(
        cls, radius: float, alpha: float, eta_convex: float, ridges: float = 0.0
    ) -> EdgeFactors:
        """Return factors with the radius in place of edge lengths, or free creases for 0."""
        return cls(alpha if radius else 0.0, eta_convex, radius, ridges)

    def of_machine_part(self) -> EdgeFactors:
        """Return the factors for a shape on which all sharp convex edges are ridges."""
        return self._replace(all_sharp=True, ridges=RIM_FACTOR * self.ridges)


class EdgeSums(NamedTuple):
    """Sums over edges."""

    turn: int  # sum of length times angle, for `evened_share`
    n_edges: int  # number of edges; 0 without ridges, like the next two members
    n_soft: int  # number of edges with an angle of 10.4 to 40 degrees
    n_sharp: int  # number of convex edges with a larger angle

    @classmethod
    def total(cls, parts: Iterable[EdgeSums]) -> EdgeSums:
        """Return the sums over several parts of a mesh."""
        return cls(*map(sum, zip(*parts, strict=True)))

    @property
    def are_of_machine_part(self) -> bool:
        """Whether half or more of all edges are flat, and a third or more of the rest is sharp."""
        is_sharp = self.n_sharp > 0 and self.n_soft <= MOST_SOFT * self.n_sharp
        return is_sharp and 2 * (self.n_soft + self.n_sharp) <= self.n_edges


NO_SUMS = EdgeSums(0, 0, 0, 0)


class Weighed(NamedTuple):
    """One weight per arc, and whether the shape is a machine part."""

    weights: npt.ArrayLike
    of_machine_part: bool = False


def superfacet_weights(
    mesh: MeshLike,
    graph: FaceGraph,
    *,
    alpha: float = 200.0,
    eta_convex: float = 0.2,
    crease_length: float | None = None,
    n_threads: int | None = None,
) -> Floats:
    r"""Return the weight of each arc: surface distance plus a price for crossing a crease.

    For faces i and j with centroids c, across an edge e with midpoint m that they share,

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \alpha\,\eta\,|e|\,\theta / \pi}{d}

    where theta is the angle between the normals, eta is 1 on a concave edge and `eta_convex` on a
    convex edge, and d is the diagonal of the bounding box. The edge is concave if the signed
    heights of each centroid above the plane of the other face have a positive sum. The weights do
    not change under rigid motion and uniform scaling. Time is linear in the number of arcs.

    If two neighbors are inconsistently oriented, the normal of the smaller face (in a tie, of the
    face with the higher index) is flipped for their arc. If a mesh is closed and its normals point
    inwards, concave and convex are swapped. If a face has no normal, theta is 0.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    graph : FaceGraph
        The graph of the same mesh, from `build_face_graph`.
    alpha : float, default 200.0
        Weight of the angular term, >= 0. With 0, weights are distances.
    eta_convex : float, default 0.2
        Weight of convex edges relative to concave ones, >= 0.
    crease_length : float, optional
        Length that replaces \|e\|, > 0, in the unit of the vertices. By default the length of each
        edge, as in the paper; creases then cost less in a finer mesh, while the distance term of a
        path does not change. With one length for all edges, such as the radius of a region, the
        cost does not depend on the resolution, and `alpha` can be smaller.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of float64, shape (M,)
        In units of d; finite, >= 0, the same for both arcs of a pair. theta is in [0, pi] radians:
        0 on a flat edge, pi where a surface folds back on itself.

    Raises
    ------
    ValueError
        If `alpha` or `eta_convex` is negative or not finite, or the graph is of another mesh.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, eq. 1-3.

    Examples
    --------
    A square of edge 1, folded along its diagonal by 90 degrees, as a ridge and as a valley:

    >>> from superfacets import Mesh, build_face_graph
    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]]
    >>> for faces in ([0, 1, 2], [0, 2, 3]), ([2, 1, 0], [3, 2, 0]):
    ...     mesh = Mesh(vertices, faces)
    ...     superfacet_weights(mesh, build_face_graph(mesh), alpha=10).round(3).tolist()
    [1.008, 1.008]
    [3.317, 3.317]
    """
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    alpha = checked_number(alpha, "alpha", zero=True)
    eta_convex = checked_number(eta_convex, "eta_convex", zero=True)
    if crease_length is not None:
        crease_length = checked_number(crease_length, "crease_length", zero=False)
    surface = Surface.of_faces(mesh, graph, threads)
    cells = (graph.positions, graph.measures, NO_NORMALS)
    return weights_of(surface, cells, EdgeFactors(alpha, eta_convex, crease_length or 0.0))


def crease_weights(
    mesh: MeshLike,
    graph: FaceGraph,
    expected_radius: float,
    *,
    alpha: float = 20.0,
    eta_convex: float = 0.0,
    ridges: float = 0.35,
    hollows: bool = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return the weight of each arc, with a cost of creases that does not depend on resolution.

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \alpha\,\eta\,r\,\theta / \pi}{d}

    The expected radius r of a region replaces the length of the edge in eq. 2. When a mesh is
    refined, its edges get shorter, so by eq. 2 creases get cheaper relative to distances. With r, a
    path that turns by theta in total costs the same on fine and coarse meshes. The rest is as for
    `superfacet_weights`.

    Convex edges are free by default, except ridges, which are sharp edges of machine parts. A ridge
    is a convex edge with an angle of at least 40 degrees. All other edges of its two faces have
    less than 0.3 of this angle. As an exception, for corners of boxes, each triangle may have a
    second sharp edge: convex or concave, of at least 40 degrees, with neither of the two angles
    below 0.7 of the other. A ridge must also continue: at each end it meets another such edge or
    the boundary of an open mesh.

    On a hollow shape, such as a cup or a ring, smooth edges (of less than 40 degrees) have other
    costs. The surface of such a shape is about as concave as convex. If only concave edges had a
    cost, the whole inside would be a crease and the outside would have no crease. Let V be the
    volume of a closed mesh, A its area and M its total mean curvature, which is half the sum of
    length times angle over all edges except ridges, negative for concave edges. :math:`y = 3 V M /
    A^2` is 1 for a ball, less for any other convex body, 3/4 for a long rod, below 0.2 for cups,
    and about 0 or less for rings. Below y = 0.3, smooth convex edges cost the fraction s = min(2 -
    y / 0.15, 1) / 4 and smooth concave edges the fraction 1 - s. Open and inconsistently oriented
    meshes do not count as hollow.

    Parameters
    ----------
    mesh, graph, n_threads
        As for `superfacet_weights`.
    expected_radius : float
        r = sqrt(A / (pi k)), >= 0, in the unit of the vertices; a `Segmentation` has it as
        ``params["expected_radius"]``. With 0 (no face has an area), weights are distances.
    alpha : float, default 20.0
        Cost, in radii, of a concave edge with angle pi, >= 0.
    eta_convex : float, default 0.0
        Weight of convex edges relative to concave ones, >= 0.
    ridges : float, default 0.35
        Weight of ridges relative to concave edges, >= 0. No effect if less than `eta_convex`.
    hollows : bool, default True
        Whether smooth edges have other costs on hollow shapes.

    Returns
    -------
    ndarray of float64, shape (M,)
        In units of d; finite, >= 0, the same for both arcs of a pair.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the graph is of another mesh.

    Examples
    --------
    >>> from superfacets import Mesh, build_face_graph
    >>> valley = Mesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> crease_weights(valley, build_face_graph(valley), 0.5, alpha=10).round(3).tolist()
    [1.874, 1.874]

    A ridge of the same angle costs about a third of this valley. With ``ridges=0`` it is free:

    >>> ridge = Mesh(valley.vertices, [[0, 1, 2], [0, 2, 3]])
    >>> crease_weights(ridge, build_face_graph(ridge), 0.5, alpha=10).round(3).tolist()
    [0.936, 0.936]
    >>> crease_weights(ridge, build_face_graph(ridge), 0.5, alpha=10, ridges=0).round(3).tolist()
    [0.43, 0.43]
    """
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    radius = checked_number(expected_radius, "expected_radius", zero=True)
    factors = EdgeFactors.of_radius(
        radius,
        checked_number(alpha, "alpha", zero=True),
        checked_number(eta_convex, "eta_convex", zero=True),
        checked_number(ridges, "ridges", zero=True),
    )
    surface = Surface.of_faces(mesh, graph, threads)
    cells = (graph.positions, graph.measures, NO_NORMALS)
    if not hollows:
        return weights_of(surface, cells, factors)
    return np.asarray(_adapted_weights(surface, cells, factors).weights)


def stk02_weights(
    mesh: MeshLike, graph: FaceGraph, *, alpha: float = 0.5, n_threads: int | None = None
) -> Floats:
    r"""Return the weight of each arc by the formula of Shlafman, Tal and Katz (2002).

    For faces i and j with centroids c and unit normals n, across an edge with midpoint m,

    .. math:: w_{ij} = (1 - \alpha) (|c_i - m| + |m - c_j|) + \alpha (1 - (n_i \cdot n_j)^2)

    Lengths are in the unit of the vertices, so regions change when the mesh is scaled or refined.
    Concave and convex edges have the same weight. Simari et al. compare their own weights with
    these. Time is linear in the arcs.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    graph : FaceGraph
        Of the same mesh, from `build_face_graph`.
    alpha : float, default 0.5
        Share of the angular term, from 0 (only distances) to 1 (only angles).
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of float64, shape (M,)
        Finite, >= 0, the same for both arcs of a pair. The angular term is 0 on a flat edge, 1 if
        the faces meet at a right angle, and 0 if a face has no normal.

    Raises
    ------
    ValueError
        If `alpha` is not in [0, 1], or the graph is of another mesh.

    References
    ----------
    Shlafman, Tal and Katz, "Metamorphosis of Polyhedral Surfaces using Decomposition", 2002. The
    form is from Simari, Picciau and De Floriani, 2014, eq. 6.

    Examples
    --------
    Two faces meet at a right angle. Their centroids are 1/3 from the common edge:

    >>> from superfacets import Mesh, build_face_graph
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0, 1]], [[0, 1, 2], [1, 0, 3]])
    >>> stk02_weights(mesh, build_face_graph(mesh), alpha=0.25).round(3).tolist()
    [0.75, 0.75]
    """
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    alpha = checked_share(alpha, "alpha")
    return _stk02_of(face_surface(mesh, graph, threads), graph.positions, alpha, threads)


def _crease_factors(radius: float, params: Mapping[str, float]) -> EdgeFactors:
    factors = (params[name] for name in ("alpha", "eta_convex", "ridges"))
    return EdgeFactors.of_radius(radius, *factors)._replace(slack=params.get("slack", 0.0))


@dataclass(frozen=True, kw_only=True)
class Weight:
    """A formula for arc weights, with its parameters and documentation."""

    about: str
    """Text for the documentation of `segment`."""
    defaults: Mapping[str, float]
    """Default parameters by the names of the arguments of `segment`. They always include alpha."""
    compute: Callable[[Surface, CellArrays, float, Mapping[str, float]], Weighed]
    """Function of the surface, its cells, the expected radius of regions, and the parameters."""
    shares: tuple[str, ...] = ()
    """Names of the parameters from 0 to 1; all other parameters are >= 0."""
    has_parts: bool = False
    """Whether steps are straight, and `parts.PartPrices` adds prices for steps between parts."""
    has_other_unit: bool = False
    """Whether the unit differs from the unit of ``"creases"``. If so, border costs are recomputed
    for the clean-up, and cells without angles cannot have these weights."""


WEIGHTS: Mapping[WeightName, Weight] = {
    "parts": Weight(
        about='like ``"creases"``, with straight steps, paths to cells two or three steps away, and'
        " a price for steps between parts of the shape, as from a finger to the palm (their"
        ' distance in the `spectral_embedding`); in volumes like ``"creases"``',
        defaults={"alpha": 17.0, "eta_convex": 0.0, "ridges": 1.0, "gamma": 2.1},
        compute=lambda surface, cells, radius, params: _adapted_weights(
            surface, cells, _crease_factors(radius, params)._replace(is_straight=True)
        ),
        has_parts=True,
    ),
    "creases": Weight(
        about="`crease_weights`: a crease costs the same to cross at every resolution of the mesh",
        defaults={"alpha": 20.0, "eta_convex": 0.0, "ridges": 0.35},
        compute=lambda surface, cells, radius, params: _adapted_weights(
            surface, cells, _crease_factors(radius, params)
        ),
    ),
    "superfacets": Weight(
        about="`superfacet_weights`: the weights of the paper",
        defaults={"alpha": 200.0, "eta_convex": 0.2},
        compute=lambda surface, cells, _, params: Weighed(
            weights_of(surface, cells, EdgeFactors(params["alpha"], params["eta_convex"], 0.0))
        ),
        has_other_unit=True,
    ),
    "stk02": Weight(
        about="`stk02_weights`: the weights that the paper compares with",
        defaults={"alpha": 0.5},
        compute=lambda surface, cells, _, params: Weighed(
            _stk02_of(surface.handle, cells[0], params["alpha"], surface.n_threads)
        ),
        shares=("alpha",),
        has_other_unit=True,
    ),
}
"""Formulas by the name that `segment` takes, for checks, documentation and the command."""


@dataclass(frozen=True)
class WeightOptions:
    """The chosen arc weights: a name with parameters, or one given weight per arc."""

    params: dict[str, Any]
    given: npt.ArrayLike | None
    usual: frozenset[str] = frozenset()  # names of parameters that have their defaults
    slack: float = 0.0  # see `EdgeFactors`

    @classmethod
    def checked(
        cls, weights: WeightName | Weights, alpha: float | None, eta_convex: float | None,
        ridges: float | None = None,
    ) -> WeightOptions:  # fmt: skip
        """Check all parameters, and keep the parameters that these weights use."""
        given = {"alpha": alpha, "eta_convex": eta_convex, "ridges": ridges}
        checked = {
            name: checked_number(value, name, zero=True)
            for name, value in given.items()
            if value is not None
        }
        if not isinstance(weights, str):
            return cls({"weights": "given"}, weights)
        checked_choice(weights, "weights", tuple(WEIGHTS))
        weight = WEIGHTS[weights]
        params = {name: checked.get(name, usual) for name, usual in weight.defaults.items()}
        for name in weight.shares:
            checked_share(params[name], name)
        return cls({"weights": weights, **params}, None, frozenset(params) - frozenset(checked))

    def counting_both_turns(self) -> WeightOptions:
        """Return the options for cells whose creases cannot be told concave or convex.

        The weight of convex creases is then at least `UNKNOWN_TURN`, unless `eta_convex` was given.
        """
        if "eta_convex" not in self.usual:
            return self
        eta = max(self.params["eta_convex"], UNKNOWN_TURN)
        return replace(self, params={**self.params, "eta_convex": eta})

    @property
    def weight(self) -> Weight | None:
        """The entry of `WEIGHTS`; None for given weights."""
        return WEIGHTS.get(self.params["weights"])

    @property
    def has_parts(self) -> bool:
        """See `Weight`; False for given weights."""
        return self.weight is not None and self.weight.has_parts

    @property
    def has_other_unit(self) -> bool:
        """See `Weight`; False for given weights."""
        return self.weight is not None and self.weight.has_other_unit

    def crease_price(self, radius: float) -> float:
        """Return the length that a crease of angle pi adds to a step."""
        price: float = self.params["alpha"] * radius
        return price

    def rim_price(self, radius: float) -> float:
        """Return the length that a ridge of `RIM_TURN` adds to a step on machine parts."""
        ridges: float = self.params["ridges"]
        return RIM_TURN * RIM_FACTOR * ridges * self.crease_price(radius)


def arc_weights(
    surface: Surface,
    faces: Arcs | Surface,
    radius: float,
    options: WeightOptions,
    normals: Floats | None = None,
) -> Weighed:
    """Return one weight per arc for regions of this radius. The core computes missing normals."""
    if options.given is not None:
        return Weighed(options.given)
    cells = (faces.positions, faces.measures, NO_NORMALS if normals is None else normals)
    assert options.weight is not None
    params = {**options.params, "slack": options.slack}
    return options.weight.compute(surface, cells, radius, params)


def step_weights(surface: Surface, options: WeightOptions, plural: str) -> Weighed:
    """Return one weight per arc of cells without angles: given weights, or lengths of steps."""
    if options.given is not None:
        return Weighed(options.given)
    if options.has_other_unit:
        name = options.params["weights"]
        raise ValueError(
            f"weights={name!r} needs faces and their angles: leave it out for {plural}"
        )
    assert surface.weights is not None
    return Weighed(surface.weights)


def creases_of(surface: Surface, radius: float, ridges: float | None = None) -> Floats:
    """Return the default `crease_weights` without hollows, for the clean-up of regions."""
    factors = _crease_factors(radius, WEIGHTS["creases"].defaults)
    if ridges is not None:
        factors = factors._replace(ridges=ridges)
    return weights_of(surface, (surface.positions, surface.measures, NO_NORMALS), factors)


def weights_of(surface: Surface, cells: CellArrays, factors: EdgeFactors) -> Floats:
    """Weights by eq. 1 to 3."""
    if isinstance(surface.handle, _core.PointSurface):
        numbers = (*factors[:3], surface.diagonal, factors.ridges)
        return _core.point_weights(surface.handle, *numbers, surface.n_threads)
    return weights_and_sums(surface, cells, factors, None)[0]


def creases_and_sums(
    surface: Surface,
    faces: Arcs,
    radius: float,
    options: WeightOptions,
    normals: Floats | None,
    shape: tuple[float, bool],
    counted: Bytes,
) -> tuple[Floats, EdgeSums]:
    """Return weights ``"creases"`` or ``"parts"`` of a part of a mesh, and sums over its edges.

    `shape` holds `evened` of `EdgeFactors`, and whether the shape is a machine part.
    """
    cells = (faces.positions, faces.measures, NO_NORMALS if normals is None else normals)
    factors = _crease_factors(radius, {**options.params, "slack": options.slack})
    evened, of_machine_part = shape
    factors = factors._replace(is_straight=options.has_parts, evened=evened)
    factors = factors.of_machine_part() if of_machine_part else factors
    return weights_and_sums(surface, cells, factors, counted)


def weights_and_sums(
    surface: Surface, cells: CellArrays, factors: EdgeFactors, counted: Bytes | None
) -> tuple[Floats, EdgeSums]:
    """Return the weights of arcs between faces, and sums over edges.

    The sums include the edges of faces with `counted`, shape (N,); `ALL_COUNT` counts all faces. If
    `counted` is None, all edges are included, and the turn is 0.
    """
    handle = surface.handle
    is_counted = ALL_COUNT if counted is None else counted
    costs = (*factors[:3], surface.diagonal, factors.ridges, factors.evened)
    kinds = (factors.is_straight, factors.all_sharp, factors.slack)
    turning, n_threads = (counted is not None, is_counted), surface.n_threads
    if isinstance(handle, _core.TriangleSurface):
        found = _core.triangle_weights(handle, *cells, *costs, *kinds, *turning, n_threads)
    else:
        found = _core.surface_weights(handle, *costs, *kinds, *turning, n_threads)
    return found[0], EdgeSums(*found[1:])


def _adapted_weights(surface: Surface, cells: CellArrays, factors: EdgeFactors) -> Weighed:
    """Return `weights_of`, adapted to the shape.

    On hollow shapes, smooth convex edges have a cost and smooth concave edges cost less. With
    straight steps, all sharp edges of machine parts are ridges.
    """
    if isinstance(surface.handle, _core.PointSurface) or not factors.alpha:
        return Weighed(weights_of(surface, cells, factors))
    is_closed = surface.volume > 0.0
    weights, sums = weights_and_sums(surface, cells, factors, ALL_COUNT if is_closed else None)
    of_part = factors.is_straight and sums.are_of_machine_part
    adapted = factors.of_machine_part() if of_part else factors
    if is_closed:
        area = _core.sum_of(cells[1], surface.n_threads)
        evened = evened_share(sums.turn, surface.volume, area, surface.diagonal)
        adapted = adapted._replace(evened=evened)
    if adapted != factors:
        weights, _ = weights_and_sums(surface, cells, adapted, None)
    return Weighed(weights, of_part)


def _stk02_of(handle: _core.Surface, positions: Floats, alpha: float, n_threads: int) -> Floats:
    if isinstance(handle, _core.TriangleSurface):
        return _core.stk02_weights(handle, positions, alpha, n_threads)
    if not isinstance(handle, _core.PolygonSurface):
        raise ValueError('weights="stk02" needs faces: choose other weights for a cloud')
    return _core.polygon_stk02_weights(handle, alpha, n_threads)
