"""Segment meshes with the methods of other authors, for comparisons with superfacets."""

from .felzenszwalb import felzenszwalb_segments
from .metis import metis_partition
from .spectral import AffinityEmbedding, affinity_embedding, normalized_cuts
from .vsa import variational_shape_approximation

__all__ = [
    "AffinityEmbedding",
    "affinity_embedding",
    "felzenszwalb_segments",
    "metis_partition",
    "normalized_cuts",
    "variational_shape_approximation",
]
