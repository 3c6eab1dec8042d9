"""Segment meshes with the methods of other authors, for comparisons with superfacets."""

from .metis import metis_partition
from .spectral import AffinityEmbedding, affinity_embedding, normalized_cuts
from .vsa import variational_shape_approximation

__all__ = [
    "AffinityEmbedding",
    "affinity_embedding",
    "metis_partition",
    "normalized_cuts",
    "variational_shape_approximation",
]
