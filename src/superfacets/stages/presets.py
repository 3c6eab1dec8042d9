"""Define groups of keywords for `segment`, and advice for users of other tools."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

SCANS: Mapping[str, Any] = MappingProxyType({"denoise": "scan", "alpha": 80.0})
"""Keywords for room scans that were fused from depth images: ``segment(mesh, 1000, **SCANS)``.
Noise is smoothed before creases are measured, and an `alpha` above the default makes borders follow
creases more closely."""

OTHER_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "compactness": "use alpha: with higher values, borders follow creases more; 0 gives the"
        " roundest regions",
        "sigma": "use denoise: steps of smoothing before creases are measured",
        "spacing": "scale the vertices instead; lengths are in the unit of the mesh",
        "convert2lab": "use features='color'",
        "channel_axis": "use features, an array with one row of numbers per face",
        "min_size_factor": "call superfacets.merge_small_regions(mesh, labels) afterwards",
        "start_label": "labels always start at 0",
        "max_iter": "use max_num_iter",
        "num_threads": "use n_threads",
        "n_jobs": "use n_threads",
        "k": "use n_segments",
        "n_superpoints": "use n_segments",
        "kThresh": "use n_segments, or superfacets.segmentator, which takes kThresh",
        "segMinVerts": "call superfacets.merge_small_regions(mesh, labels) afterwards",
        "voxel_size": "use radius: the radius of a region in the unit of the file",
        "seed_resolution": "use radius: the radius of a region in the unit of the file",
        "scans": "use **superfacets.SCANS",
        "n_clusters": "use n_segments",
        # Not "use": the command would then suggest its option --barriers, which takes a file.
        "barrier_angle": "pass barriers=superfacets.sharp_edges(mesh, 30)",
        "seed": "labels are the same on every run; init accepts the faces to start from",
        # names of earlier versions
        "expected_radius": "use radius, which is in the unit of the mesh",
        "eta_convex": "use weights=superfacets.Weights(eta_convex=...)",
        "ridges": "use weights=superfacets.Weights(ridges=...)",
        "relocate": "it is part of the default; superfacets.paper.segment does without",
        "radius_factor": "use superfacets.paper.segment",
        "min_size": "call superfacets.merge_small_regions(mesh, labels) afterwards",
        "enforce_connectivity": "call superfacets.enforce_connectivity(mesh, labels) afterwards",
        "balance": "use sizes=superfacets.Sizes(balance=...)",
        "min_measure": "use sizes=superfacets.Sizes(bounds=(lowest, highest))",
        "max_measure": "use sizes=superfacets.Sizes(bounds=(lowest, highest))",
        "cell_weights": "use sizes=superfacets.Sizes(balance=..., weights=...)",
        "cells_per_region": "use sizes=superfacets.Sizes(cells=...)",
        "feature_weight": "use features=superfacets.Features(table, weight=...)",
        "scale_features": "features are always divided by their standard deviations; the weight is"
        " in superfacets.Features(table, weight=...)",
        "weld": "use segment(superfacets.prepare(mesh, weld=False), ...)",
        "progress": "use callback, which is called with (stage, n_iter, n_moved)",
        "on_stage": "use callback, which is called with (stage, n_iter, n_moved)",
    }
)
"""Advice for users of scikit-image's ``slic``, of other tools and of earlier versions, keyed by
parameters that `segment` does not have."""
