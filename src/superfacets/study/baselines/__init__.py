"""Other methods, whose results can be compared with superfacets. The pipeline does not use them."""

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
