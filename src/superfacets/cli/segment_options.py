"""Options that ``superfacets segment`` and ``superfacets batch`` share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from .._options import INITS, ISLANDS
from ..batches.files import FileOptions
from ..cells.weights import WEIGHTS
from ..pipeline import PAPER, PARTS, SCANS
from .options import (
    COUNT,
    NOT_NEGATIVE,
    POSITIVE,
    Count,
    CountOr,
    GroupedCommand,
    Real,
    ascii_option,
    drop_attributes_option,
    force_option,
    label_options,
    threads_option,
)

Function = TypeVar("Function", bound=Callable[..., Any])


def _defaults_of(parameter: str) -> str:
    """All different defaults of a parameter among the kinds of weights, as text."""
    used = [
        weight.defaults[parameter] for weight in WEIGHTS.values() if parameter in weight.defaults
    ]
    return ", ".join(dict.fromkeys(f"{value:g}" for value in used))


def _users_of(parameter: str) -> str:
    """Names of the weights that use a parameter."""
    return " and ".join(name for name, weight in WEIGHTS.items() if parameter in weight.defaults)


_GROUPS = {
    "Used most": ("n_segments", "radius", "alpha", "output", "outputs", "formats", "is_quiet"),
    "Presets": ("scans", "paper", "parts"),
    "Creases and shape of regions": (
        "weights", "eta_convex", "ridges", "smooth", "relocate", "min_size", "islands",
        "enforce_connectivity",
    ),
    "What else borders follow": (
        "features", "feature_weight", "mask", "barriers", "labels_named",
    ),
    "Noise, long faces, clouds": (
        "denoise", "is_subdivided", "max_edge", "viewpoint", "min_opacity",
    ),
    "Seeds and the loop": ("init", "max_num_iter", "tol"),
    "Files": (
        "format", "ascii", "label_name", "vertex_labels", "drop_attributes", "force",
    ),
    "Larger than memory": (
        "is_tiled", "tile_size", "scratch", "cache",
    ),
    "Running": ("n_threads", "workers", "scheduler", "retry_failed", "as_json"),
}  # fmt: skip
"""Groups of options in the help of ``segment`` and ``batch``."""


class SegmentCommand(GroupedCommand):
    """A command with the options of `segment_options`."""

    groups = _GROUPS


_OF_SEGMENT = (
    click.option("-n", "--n-segments", type=COUNT, help="Number of regions.  [default: 150]"),
    click.option(
        "-r",
        "--radius",
        type=POSITIVE,
        help="Radius of a region, as a fraction of the mesh's diagonal, instead of -n.",
    ),
    click.option(
        "-a",
        "--alpha",
        type=NOT_NEGATIVE,
        help=f"How much borders follow creases.  [default: by weights: {_defaults_of('alpha')}]",
    ),
    click.option(
        "--eta",
        "eta_convex",
        type=NOT_NEGATIVE,
        help="Weight of convex creases relative to concave ones."
        f"  [default: by weights: {_defaults_of('eta_convex')}]",
    ),
    click.option(
        "--ridges",
        type=NOT_NEGATIVE,
        help="The same for sharp edges between flat faces, as on machine parts; 0 turns it off."
        f"  [default: {_defaults_of('ridges')} with --weights {_users_of('ridges')}]",
    ),
    click.option(
        "--weights",
        metavar="NAME",
        type=click.Choice(tuple(WEIGHTS)),
        help="What steps between neighbors cost: parts (creases, and steps from one part of a shape"
        " to another), creases, superfacets (as in the paper), or stk02 (Shlafman, Tal and Katz)."
        "  [default: parts]",
    ),
    click.option(
        "--init",
        type=click.Choice(INITS),
        help="How the first centers are placed; flood and grid make only about as many regions as"
        " -n says.  [default: geodesic]",
    ),
    click.option("--paper", is_flag=True, help="The algorithm of the paper, exactly as published."),
    click.option(
        "--parts",
        is_flag=True,
        help="Regions within the parts of a shape: --weights parts --relocate, the default.",
    ),
    click.option("--scans", is_flag=True, help="For fused scans of rooms: --denoise 5 --alpha 80."),
    click.option(
        "--denoise",
        type=CountOr("auto", 0),
        metavar="N|auto",
        help="Measure creases on positions smoothed in N steps; auto: 5 if the mesh is noisy, else"
        " 0. Results belong to the mesh as it is.  [default: 0; 5 with --scans]",
    ),
    click.option(
        "--max-iter",
        "max_num_iter",
        type=Count(0),
        default=50,
        show_default=True,
        help="Maximum number of iterations; 0 labels by the first centers.",
    ),
    click.option(
        "--tol",
        type=NOT_NEGATIVE,
        help="Stop when centers move less, in radii.  [default: 0.02; 0 with --paper]",
    ),
    click.option(
        "--relocate/--no-relocate",
        default=None,
        help="Let centers jump to where regions are large and uneven, and iterate again."
        "  [default: yes; no with --paper or other weights]",
    ),
    click.option(
        "--smooth/--no-smooth",
        default=None,
        help="Make borders straight where the surface is smooth.  [default: yes; no with --paper]",
    ),
    click.option(
        "--connect",
        "enforce_connectivity",
        is_flag=True,
        help="Disconnected regions, which --paper may give, keep one piece.",
    ),
    click.option(
        "--min-size",
        type=NOT_NEGATIVE,
        help="Regions smaller than this, in mean regions, join a neighbor.",
    ),
    click.option(
        "--islands",
        type=click.Choice(ISLANDS),
        help="Components without a seed, and small regions without a neighbor, are regions of their"
        " own, or join the nearest region, which makes -n exact (but with --init flood or grid)."
        "  [default: keep]",
    ),
    click.option(
        "--subdivide",
        "is_subdivided",
        is_flag=True,
        help="Bisect edges longer than a quarter of a region's radius first, for meshes of long"
        " thin faces. A .ply or .vtp then holds the subdivided mesh; label files hold a label for"
        " each face of IN: that with the most area in it.",
    ),
    click.option(
        "--max-edge",
        type=POSITIVE,
        help="Subdivide until no edge is longer than this, in the unit of the mesh.",
    ),
    click.option(
        "--features",
        metavar="NAME",
        multiple=True,
        help="What borders follow besides creases: color, texture, normals, height (z), or a"
        " property of the faces, points or vertices in IN; may be given several times.",
    ),
    click.option(
        "--viewpoint",
        type=Real(),
        nargs=3,
        metavar="X Y Z",
        help="Place from which all points were seen, for clouds without normals: normals that are"
        " estimated face it.",
    ),
    click.option(
        "--min-opacity",
        type=Real(0.0, 1.0),
        default=0.0,
        metavar="P",
        help="Leave out Gaussian splats that are less opaque than this, 0 to 1; their label is -1.",
    ),
    click.option(
        "--feature-weight",
        type=NOT_NEGATIVE,
        help="How much features count, in radii per standard deviation.  [default: 5]",
    ),
    threads_option,
)

_OF_FILES = (
    ascii_option,
    label_options,
    drop_attributes_option(
        "input", ": colors, normals, texture coordinates, further properties, comments"
    ),
    force_option,
)


def segment_options(function: Function) -> Function:
    """Add the options of the computation; a decorator."""
    return _with_options(function, _OF_SEGMENT)


def file_options(function: Function) -> Function:
    """Add the options for the format of mesh files; a decorator."""
    return _with_options(function, _OF_FILES)


def _with_options(function: Function, options: tuple[Callable[[Any], Any], ...]) -> Function:
    for option in reversed(options):  # click lists options in the opposite order of their addition
        function = option(function)
    return function


def options_of(
    *,
    paper: bool,
    parts: bool,
    scans: bool,
    features: tuple[str, ...],
    is_subdivided: bool,
    max_edge: float | None,
    ascii: bool,
    label_name: str,
    vertex_labels: bool,
    drop_attributes: bool,
    force: bool,
    viewpoint: tuple[float, float, float] | None,
    min_opacity: float,
    **given: Any,
) -> FileOptions:
    """Return the given options, completed by those of a preset; an error if they do not fit."""
    keywords = {name: value for name, value in given.items() if value is not None}
    if paper and (parts or scans):
        other = "--parts" if parts else "--scans"
        raise click.UsageError(f"--paper and {other} are two methods: give one of them")
    if paper and given.get("relocate"):
        raise click.UsageError("--paper moves centers in its own way: leave --relocate out")
    presets = ((paper, "--paper", PAPER), (parts, "--parts", PARTS), (scans, "--scans", SCANS))
    for is_given, option, preset in presets:
        for name in ("weights", "init") if is_given else ():
            if name in preset and keywords.get(name, preset[name]) != preset[name]:
                raise click.UsageError(f"{option} has {name} of its own: leave --{name} out")
        keywords = {**preset, **keywords} if is_given else keywords
    return FileOptions.checked(
        keywords,
        features=features,
        subdivide=is_subdivided,
        max_edge=max_edge,
        drop_attributes=drop_attributes,
        ascii=ascii,
        label_name=label_name,
        vertex_labels=vertex_labels,
        force=force,
        viewpoint=viewpoint,
        min_opacity=min_opacity,
    )
