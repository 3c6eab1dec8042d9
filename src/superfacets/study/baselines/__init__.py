"""Methods to compare superfacets with; their results have the same form.

They are no part of the pipeline, and nothing in the package depends on them.
"""

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
