"""Methods that superfacets are measured against, with results of the same form.

They are no part of the pipeline, and nothing in the package depends on them.
"""

from .vsa import variational_shape_approximation

__all__ = ["variational_shape_approximation"]
