"""Options that ``superfacets segment`` and ``superfacets batch`` share."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import click

from superfacets import PAPER, PARTS, SCANS
from superfacets.kit import WEIGHTS, FileOptions

from . import options as opts
from .options import COUNT, option, options


def _defaults_of(parameter: str) -> str:
    """Return the defaults of a parameter for all kinds of weights, without duplicates, as text."""
    used = [
        weight.defaults[parameter] for weight in WEIGHTS.values() if parameter in weight.defaults
    ]
    return ", ".join(dict.fromkeys(f"{value:g}" for value in used))


def _default_by_weights(parameter: str) -> str:
    """Return the default of a parameter for each kind of weights that uses it, as text."""
    used = {name: weight.defaults.get(parameter) for name, weight in WEIGHTS.items()}
    return ", ".join(f"{value:g} with {name}" for name, value in used.items() if value is not None)


_GROUPS = {
    "Most used": (
        "n_segments", "radius", "expected_radius", "alpha", "output", "outputs", "formats",
        "is_quiet",
    ),
    "Presets": ("scans", "paper", "parts"),
    "Creases and shape of regions": (
        "weights", "eta_convex", "ridges", "smooth", "relocate", "min_size", "islands",
        "enforce_connectivity",
    ),
    "Equal, bounded and exact sizes": (
        "balance", "max_measure", "min_measure", "cells_per_region",
    ),
    "Data that borders follow": (
        "features", "feature_weight", "mask", "mask_values", "barriers", "barrier_angle",
        "labels_named",
    ),
    "Noise, long faces, clouds": (
        "denoise", "is_subdivided", "max_edge", "viewpoint", "min_opacity",
    ),
    "Seeds and the loop": ("init", "max_num_iter", "tol"),
    "Files": (
        "format", "ascii", "label_name", "vertex_labels", "drop_attributes", "force",
    ),
    "Running": ("n_threads", "workers", "scheduler", "timeout", "retry_failed", "as_json",
                "is_verbose"),
}  # fmt: skip
"""Groups of options in the help texts of ``segment`` and ``batch``: parameter names by title."""


class SegmentCommand(opts.GroupedCommand):
    """A command whose help lists the options of `segment_options` in groups."""

    groups = _GROUPS


segment_options = options(
    option("-n --n-segments", COUNT, f"Number of regions.  [default: {opts.USUAL_COUNT}]"),
    option("-r --radius", opts.POSITIVE,
           "Radius of a region, instead of -n, as a fraction of the bounding box's diagonal. In a"
           " cloud, the bounding box contains only points inside the mask."),
    option("-R --expected-radius", opts.POSITIVE,
           "Radius of a region, instead of -n, in the unit of the file: regions have the same size"
           " in all files."),
    option("-a --alpha", opts.NOT_NEGATIVE,
           "How strongly borders follow creases."
           f"  [default: depends on --weights: {_defaults_of('alpha')}]"),
    option("--eta eta_convex", opts.NOT_NEGATIVE,
           "Weight of convex creases relative to concave creases."
           f"  [default: depends on --weights: {_defaults_of('eta_convex')}]"),
    option("--ridges", opts.NOT_NEGATIVE,
           "Weight of sharp convex edges between flat faces, as on machine parts, relative to"
           f" concave creases; 0 ignores them.  [default: {_default_by_weights('ridges')}]"),
    option("--weights NAME", tuple(WEIGHTS),
           "Cost of a step between neighbors: parts (creases, and steps from one part of a shape to"
           " another), creases, or superfacets (as in the paper)."
           "  [default: parts; superfacets with --paper]"),
    option("--init", FileOptions.CHOICES["init"],
           "How the initial centers are placed; flood and grid match -n only approximately."
           "  [default: geodesic; curve for 10,000 or more regions of less than 100 cells each;"
           " farthest with --paper]"),
    option("--paper", opts.FLAG, "Use the algorithm of the paper exactly as published."),
    option("--parts", opts.FLAG,
           "Keep regions within the parts of a shape: same as --weights parts --relocate, the"
           " default."),
    option("--scans", opts.FLAG,
           "Preset for fused scans of rooms: same as --denoise 5 --alpha 80."),
    option("--denoise N|auto", opts.CountOr("auto", 0),
           "Measure creases on a copy of the mesh, smoothed in N steps; auto estimates the noise"
           " and uses 0 steps if the mesh is clean. Outputs are not smoothed.  [default: auto; 5"
           " with --scans, 0 with --paper]"),
    option("--max-iter max_num_iter", opts.Count(0),
           "Maximum number of iterations; 0 keeps the initial centers.", default=50),
    option("--tol", opts.NOT_NEGATIVE,
           "Stop when centers move less than this, as a fraction of a region's radius."
           "  [default: 0.02; 0 with --paper]"),
    option("--relocate/--no-relocate", None,
           "Move some centers to places where regions are large and uneven, and iterate again."
           "  [default: yes with --weights parts, otherwise no]", default=None),
    option("--smooth/--no-smooth", None,
           "Straighten borders where the surface is smooth.  [default: yes; no with --paper]",
           default=None),
    option("--connect enforce_connectivity", opts.FLAG,
           "Keep one piece of each disconnected region, and join its other pieces to neighbors."
           " It has an effect only with --paper."),
    option("--min-size", opts.NOT_NEGATIVE,
           "Merge regions smaller than this fraction of the mean size into a neighbor."),
    option("--islands", FileOptions.CHOICES["islands"],
           "What to do with components without a seed, and with small regions without a neighbor:"
           " keep them as regions (keep), or join them to the nearest region (nearest), which makes"
           " -n exact except with barriers, or --init flood or grid.  [default: keep]"),
    option("--balance", opts.Real(0.0, 1.0),
           "How equal the areas or volumes of regions should be, from 0 to 1.  [default: 0]"),
    option("--max-measure", opts.POSITIVE,
           "Maximum area or volume of a region, in squared or cubed units of the mesh."),
    option("--min-measure", opts.NOT_NEGATIVE,
           "Minimum area or volume of a region, in squared or cubed units of the mesh."),
    option("--cells-per-region", COUNT,
           "Exact number of faces or points in each region, instead of -n; the remaining faces or"
           " points of each component form one smaller region."),
    option("--subdivide is_subdivided", opts.FLAG,
           "First bisect edges longer than a quarter of a region's radius, for meshes with long and"
           " thin faces. A .ply or .vtp then contains the subdivided mesh. Label files contain one"
           " label for each face of IN: the label that covers most of the face."),
    option("--max-edge", opts.POSITIVE,
           "First bisect edges longer than this, in the unit of the mesh."),
    option("--features NAME", None,
           "Data that borders follow besides creases: color, texture, normals, height (z), or a"
           " property of the faces, points or vertices in IN; may be given several times.",
           multiple=True),
    opts.viewpoint_option,
    option("--min-opacity P", opts.Real(0.0, 1.0),
           "Leave out Gaussian splats with an opacity below this, 0 to 1; they get label -1.",
           default=0.0, show_default=False),
    option("--feature-weight", opts.NOT_NEGATIVE,
           "Weight of features: a difference of one standard deviation adds this many region radii"
           " to the length of a path.  [default: 5]"),
    opts.threads_option,
)  # fmt: skip
"""Decorator that adds the options that control the segmentation to a command."""

file_options = options(
    opts.ascii_option,
    opts.label_options,
    opts.drop_attributes_option(
        "IN", ": colors, normals, texture coordinates, other properties, comments"
    ),
    opts.force_option,
)
"""Decorator that adds the options for the format of mesh files to a command."""


_OF_FILES = {field.name for field in fields(FileOptions)}


def options_of(
    *, paper: bool, parts: bool, scans: bool, is_subdivided: bool, **given: Any
) -> FileOptions:
    """Return the options, completed by presets; raise a usage error if options are incompatible."""
    of_files = {name: given.pop(name) for name in _OF_FILES & given.keys()}
    of_files = {name: value for name, value in of_files.items() if value is not None}
    keywords = {name: value for name, value in given.items() if value is not None}
    if len({"n_segments", "radius", "expected_radius"} & keywords.keys()) > 1:
        raise click.UsageError("give only one of -n, -r and -R")
    if paper and (parts or scans):
        other = "--parts" if parts else "--scans"
        raise click.UsageError(f"give --paper or {other}, not both")
    if paper and given.get("relocate"):
        raise click.UsageError("give --paper or --relocate, not both")
    for name in ("balance", "max_measure", "min_measure", "cells_per_region"):
        if paper and keywords.get(name):
            raise click.UsageError(f"give --paper or --{name.replace('_', '-')}, not both")
    presets = ((paper, "--paper", PAPER), (parts, "--parts", PARTS), (scans, "--scans", SCANS))
    for is_given, name_of_preset, preset in presets:
        for name in ("weights", "init") if is_given else ():
            if name in preset and keywords.get(name, preset[name]) != preset[name]:
                raise click.UsageError(
                    f"{name_of_preset} sets --{name} {preset[name]}: leave --{name} out"
                )
        keywords = {**preset, **keywords} if is_given else keywords
    try:
        return FileOptions(keywords, subdivide=is_subdivided, **of_files)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
