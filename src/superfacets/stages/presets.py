"""Define groups of keywords for `segment`, and advice for users of other tools."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

PAPER: Mapping[str, Any] = MappingProxyType(
    {
        "weights": "superfacets",
        "init": "farthest",
        "radius_factor": 2.0,
        "tol": 0.0,
        "smooth": False,
        "denoise": 0,
    }
)
"""Keywords for the algorithm as published in the paper: ``segment(mesh, 150, **PAPER)``. Weights
are computed with equations 1 to 3 of the paper, and seeds are placed by farthest-point sampling.
Paths end at 2 r from the center, where r is the expected radius of a region. The loop stops when no
center moves, when the centers return to an earlier state, or after 50 iterations. Neither the mesh
nor the borders are smoothed."""

PARTS: Mapping[str, Any] = MappingProxyType({"weights": "parts", "relocate": True})
"""Keywords for regions that each stay within one part of a shape, such as a finger of a hand. They
are the defaults of `segment`."""

SCANS: Mapping[str, Any] = MappingProxyType({"denoise": 5, "alpha": 80.0})
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
        "min_size_factor": "use min_size: a fraction of the mean area of regions",
        "start_label": "labels always start at 0",
        "max_iter": "use max_num_iter",
        "num_threads": "use n_threads",
        "n_jobs": "use n_threads",
        "k": "use n_segments",
        "n_superpoints": "use n_segments",
        "kThresh": "use n_segments, or superfacets.segmentator, which takes kThresh",
        "segMinVerts": "use min_size: a fraction of the mean area of regions",
        "voxel_size": "use expected_radius: the radius of a region in the unit of the file",
        "seed_resolution": "use expected_radius: the radius of a region in the unit of the file",
        "scans": "use **superfacets.SCANS",
        "n_clusters": "use n_segments",
        # Not "use": the command would then suggest its option --barriers, which takes a file.
        "barrier_angle": "pass barriers=superfacets.sharp_edges(mesh, 30)",
        "seed": "labels are the same on every run; init accepts the faces to start from",
    }
)
"""Advice for users of scikit-image's ``slic`` and of other tools, keyed by parameters that
`segment` does not have."""
