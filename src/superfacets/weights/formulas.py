"""Compute the weight of each arc from the distance and the angle between its two cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_choice, checked_number, checked_threads
from ..base.types import Floats, Singles
from ..graph.cell_graph import BaseGraph
from ..graph.face_graph import FaceGraph
from ..graph.kinds import Kind
from ..graph.surface import NO_NORMALS, Surface
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import unit_normals

SOLID = 0.3
"""Shapes with at least this roundness y (defined in `crease_weights`) are not treated as hollow."""

HOLLOW = 0.15
"""Closed shapes with at most this roundness y (see `SOLID`) are treated as fully hollow."""

MAX_EVENED = 0.25
"""Cost of smooth convex edges on fully hollow shapes, relative to sharp concave edges."""

STEPS = 1 << 16
"""Number of steps between 0 and `MAX_EVENED`. `convex_share_of` rounds its result to one of these
steps, so that small rounding errors in sums do not change the result."""

CURVATURE_BITS = 31
"""`EdgeSums.curvature` is an integer in units of about diagonal / 2**CURVATURE_BITS."""


def convex_share_of(curvature: int, volume: float, area: float, diagonal: float) -> float:
    """Return s of `crease_weights`, the relative cost of smooth convex edges."""
    if not volume or not area:
        return 0.0
    unit = math.ldexp(1.0, math.frexp(diagonal)[1] - 1 - CURVATURE_BITS)
    roundness = 3.0 * volume * (curvature * unit / 2.0) / area**2
    hollowness = min(max((SOLID - roundness) / (SOLID - HOLLOW), 0.0), 1.0)
    return MAX_EVENED * round(STEPS * hollowness) / STEPS


UNKNOWN_TURN = 0.5
"""Cost of convex creases, relative to concave creases, for point clouds on which convex and concave
creases cannot be distinguished. In a synthetic room without normals, 1.5 % of the points are in a
region that mainly covers another wall. With a cost of 0, this fraction is 8.5 %, and with a cost of
1, it is 1.4 %."""

MIN_FLAT = 0.25
"""Minimum share of exactly flat edges of a made thing, such as a machine part, and minimum share of
the area in flat sides, which are not just subdivided triangles. On organic shapes and scans, at
most 10 % of the edges are flat."""

MIN_MADE = 0.7
"""Minimum sum, on a made thing, of the share of flat edges and the share of the turn at edges of 40
degrees or more. This sum is at least 0.73 for 12 of the 13 CAD parts of the study, and at most 0.66
for the chairs of the benchmark, on which people do not draw borders at all bends."""

ROUNDED_EDGES, ROUNDED_SIDES = 0.4, 0.85
"""Minimum shares of flat edges, and of the area in flat sides, of made things without sharp edges,
such as a block whose rounded edges have many small faces. Chairs and tables of the benchmark have
at most 77 % of the area in flat sides; spheres and tori of quads have 33 % of flat edges."""

MADE_FACTOR = 2.17
"""Factor of the cost of all bends on made things. With a factor of 1, up to 2 % of the rims of
machine parts are not borders of regions."""

CREASE_LIMIT_ANGLE = 59 / 180
"""Minimum angle, divided by pi, of bends that coarse cells must not cross on made things. If a
coarse cell crossed an edge, a side that is narrower than the coarse cell would get no region of its
own. The limit is 59 degrees, so that the edges of a hexagonal prism (60 degrees) are included."""


WeightName = Literal["parts", "creases", "superfacets"]

ArcValues: TypeAlias = Sequence[float] | npt.NDArray[np.floating[Any] | np.integer[Any]]
"""Weights given by the caller, one per arc."""

CellArrays = tuple[Floats, Floats]
"""Two arrays: positions of all cells (N, 3), and their areas (N,)."""


class EdgeFactors(NamedTuple):
    """Parameters of the formulas for the weights of arcs."""

    alpha: float  # cost of a concave edge with angle pi, as a multiple of `crease_length`
    eta_convex: float  # cost of convex edges, relative to concave edges
    crease_length: float  # length to which costs are proportional; 0 to use each edge's own length
    ridges: float = 0.0  # cost of ridges (sharp convex edges), relative to concave edges
    is_straight: bool = False  # distances are straight lines, and made things are recognized
    convex_share: float = 0.0  # s in `crease_weights`: relative cost of smooth convex edges
    slack: float = 0.0  # radians by which each angle is reduced, but not below 0
    unit_factor: float = 0.0  # see `Lengths`; 0 if weights are not to be rounded

    @classmethod
    def checked(cls, radius: float, alpha: float, eta_convex: float, ridges: float) -> EdgeFactors:
        """Return factors with `radius` as `crease_length`. If `radius` is 0, `alpha` becomes 0."""
        given = {"radius": radius, "alpha": alpha, "eta_convex": eta_convex, "ridges": ridges}
        length, cost, of_convex, of_ridges = (
            checked_number(value, name, zero=True) for name, value in given.items()
        )
        return cls(cost if length else 0.0, of_convex, length, of_ridges)

    def for_core(self, diagonal: float) -> _core.EdgeFactors:
        """Convert the factors to a `_core` object. `diagonal` is d in `superfacet_weights`."""
        return _core.EdgeFactors(diagonal=diagonal, **self._asdict())

    def for_made_things(self) -> EdgeFactors:
        """Return the factors for made things, on which all convex bends cost as much as ridges."""
        eta_convex = max(self.eta_convex, self.ridges)
        return self._replace(alpha=MADE_FACTOR * self.alpha, eta_convex=eta_convex)


class EdgeSums(NamedTuple):
    """Sums over the edges of a mesh. Boundary edges are not included.

    Turns are sums of length times angle, in the unit that `CURVATURE_BITS` defines. All sums
    but `curvature` are 0 unless ridges cost more than other convex edges.
    """

    curvature: int  # turn of all edges except ridges, in which concave edges are negative
    n_edges: int  # number of edges
    n_flat: int  # number of edges with an angle below 0.05 degrees
    bent: int  # turn of all edges, in which all are positive
    sharp: int  # turn of the edges with an angle of at least 40 degrees

    def are_of_made_thing(self, surface: Surface, arrays: CellArrays) -> bool:
        """Whether edges are mostly flat or sharp, as on a machine part; see `MIN_MADE`."""
        flat, sharp = self.n_flat / max(self.n_edges, 1), self.sharp / max(self.bent, 1)
        if flat < MIN_FLAT or (flat + sharp < MIN_MADE and flat < ROUNDED_EDGES):
            return False
        n_threads = surface.n_threads
        normals = NO_NORMALS if surface.mesh is None else unit_normals(surface.mesh, n_threads)
        sides = _core.share_of_flat_sides(surface.handle, arrays[1], normals, n_threads)
        if flat >= ROUNDED_EDGES and sides >= ROUNDED_SIDES:
            return True
        return min(flat, sides) >= MIN_FLAT and min(flat, sides) + sharp >= MIN_MADE


class Lengths(NamedTuple):
    """Weights of arcs, rounded to integers so that sums of weights are exact."""

    values: Singles  # (M,) weight of each arc as an integer multiple of `unit`
    unit: float  # weight that corresponds to a value of 1: see `BaseGraph.quantized`


class ArcWeights(NamedTuple):
    """Weights of all arcs of a graph."""

    weights: Any  # weight of each arc, (M,): an array, or `Lengths` if factors say so
    of_made_thing: bool = False  # whether the factors of `EdgeFactors.of_made_thing` were used


def superfacet_weights(
    mesh: MeshLike, graph: FaceGraph, *, alpha: float = 200.0, eta_convex: float = 0.2,
    crease_length: float | None = None, n_threads: int | None = None,
) -> Floats:  # fmt: skip
    r"""Return the weight of each arc: the distance on the surface plus a cost for creases.

    For faces i and j with centroids c and a common edge e with midpoint m,

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \alpha\,\eta\,|e|\,\theta / \pi}{d}

    where theta is the angle between the normals, eta is 1 on a concave edge and `eta_convex` on a
    convex edge, and d is the diagonal of the bounding box. An edge is concave if the sum of the
    signed heights of both centroids above the plane of the other face is positive, and convex
    otherwise.

    If two neighbors are inconsistently oriented, the normal of the smaller face is flipped for
    their arc; if the areas are equal, the one of the face with the higher index. If normals of
    a closed mesh point inward, concave and convex are swapped. If a face has no normal, theta is 0.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    graph : FaceGraph
        The graph of the same mesh, from `build_face_graph`.
    alpha : float, default 200.0
        Weight of the angular term, >= 0. With 0, weights are distances.
    eta_convex : float, default 0.2
        Cost of convex edges relative to concave edges, >= 0.
    crease_length : float, optional
        Length that replaces \|e\| for all edges, > 0, in the unit of the vertices. By default,
        \|e\| is the length of the edge, as in the paper, so creases cost less in finer meshes.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    ndarray of float64, shape (M,)
        Weight of each arc in units of d, finite and >= 0. An arc and its reverse arc have the same
        weight. theta is from 0 (a flat edge) to pi radians (a surface that folds back on itself).

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, if a number is out of range, not finite or of the
        wrong type, or if the graph is of another mesh.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, equations 1 to 3.

    Examples
    --------
    A square of side 1 is folded along its diagonal by 90 degrees, to a ridge and to a valley:

    >>> from superfacets import build_face_graph
    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]]
    >>> for faces in ([0, 1, 2], [0, 2, 3]), ([2, 1, 0], [3, 2, 0]):
    ...     mesh = (vertices, faces)
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
    arrays = (graph.positions, graph.measures)
    return weights_of(surface, arrays, EdgeFactors(alpha, eta_convex, crease_length or 0.0))


def crease_weights(
    mesh: MeshLike, graph: FaceGraph, radius: float, *, alpha: float = 20.0,
    eta_convex: float = 0.0, ridges: float = 0.35, hollows: bool = True,
    n_threads: int | None = None,
) -> Floats:  # fmt: skip
    r"""Return the weight of each arc, with a cost for creases that does not depend on resolution.

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \alpha\,\eta\,r\,\theta / \pi}{d}

    The expected radius r of a region replaces the length of the edge in `superfacet_weights`, so a
    path whose angles sum to theta costs the same on fine and coarse meshes. All other rules are the
    same.

    By default, convex edges have no cost, except ridges: the sharp edges of machine parts. A ridge
    is a convex edge of at least 40 degrees that satisfies two rules. First, all other edges of its
    two faces have less than 0.3 times this angle. At box corners, a triangle may have one other
    edge of at least 40 degrees, and a polygon any number, if the smaller angle is at least 0.7
    times the larger. Second, the ridge continues: at each end, it meets another edge that satisfies
    the first rule, an edge of three or more faces, or the boundary of an open mesh.

    On hollow shapes, such as a cup or a ring, the costs of smooth edges (below 40 degrees) change,
    because otherwise only concave ones would have a cost. Let V be the volume of a closed
    mesh, A its area, and M its total mean curvature: half the sum of length times angle over all
    edges except ridges, negative for concave edges. The roundness :math:`y = 3 V M / A^2` is 1 for
    a ball, 3/4 for a long rod, below 0.2 for cups, and about 0 or less for rings. If y is less than
    0.3, smooth convex edges have the relative cost s = min(2 - y / 0.15, 1) / 4 (or `eta_convex`,
    if this is larger), and smooth concave edges have the relative cost 1 - s. Open and
    inconsistently oriented meshes are never hollow.

    Parameters
    ----------
    mesh, graph, n_threads
        Same as in `superfacet_weights`.
    radius : float
        Expected radius r = sqrt(A / (pi k)) of regions, >= 0, in the unit of the vertices. In a
        `Segmentation`, it is ``params["radius"]``. With 0, weights are distances.
    alpha : float, default 20.0
        Cost of a concave edge with angle pi, in units of r, >= 0.
    eta_convex : float, default 0.0
        Cost of convex edges relative to concave edges, >= 0.
    ridges : float, default 0.35
        Cost of ridges relative to concave edges, >= 0. A cost below `eta_convex` has no effect.
    hollows : bool, default True
        Whether the costs of smooth edges are changed on hollow shapes.

    Returns
    -------
    ndarray of float64, shape (M,)
        Weight of each arc in units of d, finite and >= 0. An arc and its reverse arc have the same
        weight.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, if a number is negative, not finite or of the
        wrong type, or if the graph is of another mesh.

    Examples
    --------
    >>> from superfacets import build_face_graph
    >>> valley = ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> crease_weights(valley, build_face_graph(valley), 0.5, alpha=10).round(3).tolist()
    [1.874, 1.874]
    """
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    factors = EdgeFactors.checked(radius, alpha, eta_convex, ridges)
    surface = Surface.of_faces(mesh, graph, threads)
    arrays = (graph.positions, graph.measures)
    if not hollows:
        return weights_of(surface, arrays, factors)
    return np.asarray(_adapted_weights(surface, arrays, factors).weights)


def _crease_factors(radius: float, params: Mapping[str, float]) -> EdgeFactors:
    costs = (params[name] for name in ("alpha", "eta_convex", "ridges"))
    slack, unit_factor = params.get("slack", 0.0), params.get("unit_factor", 0.0)
    return EdgeFactors.checked(radius, *costs)._replace(slack=slack, unit_factor=unit_factor)


@dataclass(frozen=True, kw_only=True)
class Formula:
    """A formula for arc weights, with its parameters and documentation."""

    about: str
    """Description of the formula in the documentation of `segment`."""
    defaults: Mapping[str, float]
    """Default values of parameters, keyed by the names of arguments of `segment`."""
    compute: Callable[[Surface, CellArrays, float, Mapping[str, float]], ArcWeights]
    """Function that computes the weights from a `Surface`, the `CellArrays` of its cells, the
    radius of regions, and parameters by name, also ``slack`` and ``unit_factor`` of EdgeFactors."""
    has_part_costs: bool = False
    """Whether costs of likely borders and between parts of the shape are added to the weights."""
    has_other_unit: bool = False
    """Whether the weights have another unit than ``"creases"``. If so, the clean-up of regions does
    not use these weights but recomputes the costs of borders, and the formula is not available for
    cells without angles."""


WEIGHTS: Mapping[WeightName, Formula] = {
    "parts": Formula(
        about='like ``"creases"``, with straight lines between cells up to three arcs apart, and a'
        " cost between parts of the shape",
        defaults={"alpha": 8.3, "eta_convex": 0.0, "ridges": 1.0, "gamma": 1.68},  # of PartCosts
        compute=lambda surface, arrays, radius, params: _adapted_weights(
            surface, arrays, _crease_factors(radius, params)._replace(is_straight=True)
        ),
        has_part_costs=True,
    ),
    "creases": Formula(
        about="`crease_weights`, whose costs do not depend on the resolution",
        defaults={"alpha": 20.0, "eta_convex": 0.0, "ridges": 0.35},
        compute=lambda surface, arrays, radius, params: _adapted_weights(
            surface, arrays, _crease_factors(radius, params)
        ),
    ),
    "superfacets": Formula(
        about="`superfacet_weights` of the paper",
        defaults={"alpha": 200.0, "eta_convex": 0.2},
        compute=lambda surface, arrays, _, params: ArcWeights(
            weights_of(surface, arrays, EdgeFactors(params["alpha"], params["eta_convex"], 0.0))
        ),
        has_other_unit=True,
    ),
}
"""All formulas for weights. Keys are choices for the argument `weights` of `segment`."""


@dataclass(frozen=True)
class Weights:
    """A formula for the weights of arcs, with its parameters: the argument `weights` of `segment`.

    Parameters
    ----------
    name : {"parts", "creases", "superfacets"}, default "parts"
        Name of the formula; see `segment`.
    alpha : float, optional
        How strongly borders follow creases, >= 0. With 0, regions are most compact. The defaults of
        all parameters depend on the formula.
    eta_convex : float, optional
        Cost of convex edges other than ridges, relative to concave edges with the same angle, >= 0.
    ridges : float, optional
        Cost of ridges, relative to concave edges, >= 0. Ridges are sharp convex edges between flat
        areas, as on machine parts. ``"superfacets"`` does not know ridges.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of range, of the wrong type, or unknown to the formula.

    Examples
    --------
    >>> import superfacets
    >>> mesh = superfacets.sample_mesh(5_000)
    >>> weights = superfacets.Weights("creases", alpha=30, ridges=0)
    >>> superfacets.segment(mesh, 20, weights=weights).params["ridges"]
    0.0
    """

    name: WeightName = "parts"
    _: KW_ONLY
    alpha: float | None = None
    eta_convex: float | None = None
    ridges: float | None = None

    def __post_init__(self) -> None:
        """Check the parameters."""
        checked_choice(self.name, "weights", tuple(WEIGHTS))
        for name, value in self.given.items():
            object.__setattr__(self, name, checked_number(value, name, zero=True))
            if name not in WEIGHTS[self.name].defaults:
                raise ValueError(f"weights {self.name!r} have no parameter {name}: leave it out")

    @property
    def given(self) -> dict[str, float]:
        """The parameters that are not None, by name."""
        values = {name: getattr(self, name) for name in ("alpha", "eta_convex", "ridges")}
        return {name: value for name, value in values.items() if value is not None}


@dataclass(frozen=True)
class WeightOptions:
    """Options for weights: a formula with parameters, or weights given by the caller."""

    params: dict[str, Any]  # name and parameters of the formula, as in `Segmentation.params`
    given: npt.ArrayLike | None  # (M,) weights given by the caller, or None to use a formula
    usual: frozenset[str] = frozenset()  # names of parameters that the caller did not set
    angle_slack: float = 0.0  # see `EdgeFactors.slack`

    @classmethod
    def checked(
        cls, weights: WeightName | Weights | ArcValues | None, alpha: float | None
    ) -> WeightOptions:
        """Check the arguments of `segment`."""
        if weights is None or isinstance(weights, str):
            weights = Weights("parts" if weights is None else weights)
        if not isinstance(weights, Weights):
            if alpha is not None:
                raise ValueError("alpha does not change weights given as an array: leave it out")
            return cls({"weights": "given"}, weights)
        if alpha is not None:
            if weights.alpha is not None:
                raise ValueError(f"alpha is {alpha} and, in Weights, {weights.alpha}: give it once")
            weights = replace(weights, alpha=alpha)
        defaults, given = WEIGHTS[weights.name].defaults, weights.given
        params = {"weights": weights.name, **defaults, **given}
        return cls(params, None, frozenset(defaults) - frozenset(given))

    def with_convex_costs(self) -> WeightOptions:
        """Return options for clouds on which convex and concave creases look the same.

        Convex creases cost at least `UNKNOWN_TURN`, unless the caller has set `eta_convex`.
        """
        if "eta_convex" not in self.usual:
            return self
        eta = max(self.params["eta_convex"], UNKNOWN_TURN)
        return replace(self, params={**self.params, "eta_convex": eta})

    @property
    def formula(self) -> Formula | None:
        """The formula, or None if the caller gave weights."""
        return WEIGHTS.get(self.params["weights"])

    @property
    def has_part_costs(self) -> bool:
        """Value of `Formula.has_part_costs`; False if the caller gave weights."""
        return self.formula is not None and self.formula.has_part_costs

    @property
    def has_other_unit(self) -> bool:
        """Value of `Formula.has_other_unit`; False if the caller gave weights."""
        return self.formula is not None and self.formula.has_other_unit

    def crease_cost(self, radius: float) -> float:
        """Return the length that a concave crease with angle pi adds to an arc, for this radius."""
        return float(self.params["alpha"]) * radius

    def crease_limit(self, radius: float) -> float:
        """Return the minimum crease cost of arcs that coarse cells of made things never cross."""
        bends = MADE_FACTOR * max(float(self.params["eta_convex"]), float(self.params["ridges"]))
        return CREASE_LIMIT_ANGLE * bends * self.crease_cost(radius)


def weights_of_kind(
    kind: Kind, surface: Surface, graph: BaseGraph, radius: float, options: WeightOptions,
    unit_factor: float = 0.0,
) -> ArcWeights:  # fmt: skip
    """Return one weight per arc between cells of any kind, for regions with this radius."""
    if kind.has_angles or options.given is not None:
        return arc_weights(surface, graph, radius, options, unit_factor)
    if options.has_other_unit:
        name = options.params["weights"]
        raise ValueError(
            f"the weights {name!r} need angles between faces: call superfacets.segment without"
            f" weights for {kind.plural}"
        )
    assert surface.weights is not None  # distances, or the weights of a `CellGraph`
    return ArcWeights(surface.weights)


def arc_weights(
    surface: Surface, faces: BaseGraph | Surface, radius: float, options: WeightOptions,
    unit_factor: float = 0.0,
) -> ArcWeights:  # fmt: skip
    """Return one weight per arc of a mesh or cloud, for regions with the expected radius `radius`.

    `faces` has positions and measures. See `EdgeFactors` for `unit_factor`.
    """
    if options.given is not None:
        return ArcWeights(options.given)
    arrays = (faces.positions, faces.measures)
    assert options.formula is not None
    params = {**options.params, "slack": options.angle_slack, "unit_factor": unit_factor}
    return options.formula.compute(surface, arrays, radius, params)


def creases_of(surface: Surface, radius: float, ridges: float | None = None) -> Floats:
    """Return `crease_weights` with default parameters (except `ridges`) and ``hollows=False``."""
    factors = _crease_factors(radius, WEIGHTS["creases"].defaults)
    if ridges is not None:
        factors = factors._replace(ridges=ridges)
    return weights_of(surface, (surface.positions, surface.measures), factors)


def weights_of(surface: Surface, arrays: CellArrays, factors: EdgeFactors) -> Floats:
    """Return one weight per arc, computed with equations 1 to 3 of the paper and these factors."""
    weights: Floats = weights_and_sums(surface, arrays, factors, wants_sums=False)[0]
    return weights


def weights_and_sums(
    surface: Surface, arrays: CellArrays, factors: EdgeFactors, *, wants_sums: bool
) -> tuple[Any, EdgeSums]:
    """Return the result of `weights_of`, and `EdgeSums`, which are 0 unless `wants_sums`.

    On large graphs, weights are `Lengths` instead of an array if `factors.unit_factor` is positive.
    """
    handle, costs = surface.handle, factors.for_core(surface.diagonal)
    if isinstance(handle, _core.TriangleSurface):
        found = _core.triangle_weights(handle, *arrays, costs, wants_sums, surface.n_threads)
    elif isinstance(handle, _core.PointSurface):
        found = _core.point_weights(handle, costs, surface.n_threads)
    else:
        found = _core.surface_weights(handle, costs, wants_sums, surface.n_threads)
    weights, lengths, unit, sums = found
    return Lengths(lengths, unit) if len(lengths) else weights, EdgeSums(*sums)


def _adapted_weights(surface: Surface, arrays: CellArrays, factors: EdgeFactors) -> ArcWeights:
    """Return the result of `weights_of`, with costs adapted to made things and hollow shapes."""
    if isinstance(surface.handle, _core.PointSurface) or not factors.alpha:
        return ArcWeights(weights_of(surface, arrays, factors))
    is_closed = surface.volume > 0.0
    wants_sums = is_closed or factors.is_straight
    weights, sums = weights_and_sums(surface, arrays, factors, wants_sums=wants_sums)
    of_made_thing = factors.is_straight and sums.are_of_made_thing(surface, arrays)
    adapted = factors.for_made_things() if of_made_thing else factors
    if is_closed and not of_made_thing:
        area = _core.sum_of(arrays[1], surface.n_threads)
        convex_share = convex_share_of(sums.curvature, surface.volume, area, surface.diagonal)
        adapted = adapted._replace(convex_share=convex_share)
    if adapted != factors:
        del weights  # to save memory
        weights = weights_of(surface, arrays, adapted)
    return ArcWeights(weights, of_made_thing)
