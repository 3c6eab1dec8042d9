"""Runs of the clustering with options that only `paper.segment` or the default weights set."""

from dataclasses import replace
from inspect import signature

import superfacets
from superfacets.base.options import CountOptions, LoopOptions
from superfacets.clustering.run import segment_checked
from superfacets.graph.constraints import ConstraintOptions
from superfacets.pipeline import run
from superfacets.stages.options import SegmentOptions
from superfacets.weights.features import Features

DEFAULTS = {name: one.default for name, one in signature(superfacets.segment).parameters.items()}
del DEFAULTS["mesh"]


def segment_graph(
    graph, n_segments=None, *, init=None, mask=None, barriers=None, relocates=False,
    radius_factor=None, islands="keep", max_num_iter=50, tol=0.02, n_threads=None, callback=None,
):  # fmt: skip
    """Run `segment_graph`, with relocation of centers, or with a limit of paths."""
    loop = LoopOptions.checked(max_num_iter, tol, islands, n_threads, callback)
    loop = replace(loop, relocates=relocates, radius_factor=radius_factor)
    start = (CountOptions.checked(n_segments, None, init), init)
    return segment_checked(graph, start, loop, Features(None), ConstraintOptions(mask, barriers))


def segment(mesh, n_segments=None, *, paper=False, init=None, relocates=True, radius_factor=None,
            **options):  # fmt: skip
    """Run `paper.segment`, or `segment` with any seeding, without relocation, or with a limit."""
    if paper:
        return superfacets.paper.segment(mesh, n_segments, **options)
    is_plain = not isinstance(init, str)
    asked = {**DEFAULTS, "n_segments": n_segments, "init": init if is_plain else None, **options}
    checked = SegmentOptions.checked(**asked)
    loop = replace(checked.loop, radius_factor=radius_factor)
    relocates = relocates and radius_factor is None
    return run(mesh, replace(checked, loop=loop, may_relocate=relocates, init=init))
