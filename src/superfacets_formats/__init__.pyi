"""Names that other apps use, beside the public names of superfacets."""

from .cortex import CORTEX_VALUES as CORTEX_VALUES
from .cortex import values_of_vertices as values_of_vertices
from .las import las_steps as las_steps
