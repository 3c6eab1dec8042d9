"""Methods that superfacets are measured against, with results of the same form.

They are no part of the pipeline, and nothing in the package depends on them.
"""

from .metis import metis_partition
from .spectral import SpectralEmbedding, normalized_cuts, spectral_embedding
from .vsa import variational_shape_approximation

__all__ = [
    "SpectralEmbedding",
    "metis_partition",
    "normalized_cuts",
    "spectral_embedding",
    "variational_shape_approximation",
]
