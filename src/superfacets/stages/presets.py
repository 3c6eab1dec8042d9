"""Define groups of keywords for `segment`, and advice for users of other tools."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

SCANS: Mapping[str, Any] = MappingProxyType({"denoise": "scan", "alpha": 60.0})
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
        **dict.fromkeys(("num_threads", "n_jobs"), "use n_threads"),
        **dict.fromkeys(("k", "n_superpoints", "n_clusters"), "use n_segments"),
        "kThresh": "use n_segments, or superfacets.segmentator, which takes kThresh",
        "segMinVerts": "call superfacets.merge_small_regions(mesh, labels) afterwards",
        "voxel_size": "use radius: the radius of a region in the unit of the file",
        "seed_resolution": "use radius: the radius of a region in the unit of the file",
        "scans": "use **superfacets.SCANS",
        **dict.fromkeys(("n_regions", "n_patches"), "use n_segments"),
        # Not "use": the command would then suggest its option --barriers, which takes a file.
        "barrier_angle": "pass barriers=superfacets.sharp_edges(mesh, 30)",
        "seed": "labels are the same on every run; init accepts the faces to start from",
        "random_state": "labels are the same on every run; init accepts the faces to start from",
        "eta_convex": "use weights=superfacets.Weights(eta_convex=...)",
        "ridges": "use weights=superfacets.Weights(ridges=...)",
        "min_size": "call superfacets.merge_small_regions(mesh, labels) afterwards",
        "balance": "use sizes=superfacets.Sizes(balance=...)",
        "weld": "use segment(superfacets.prepare(mesh, weld=False), ...)",
    }
)
"""Advice for users of ``slic`` of scikit-image and of other tools, keyed by parameters that
`segment` does not have."""
