"""Names that other apps use, beside the public names of superfacets."""

from .cortex import CORTEX_VALUES as CORTEX_VALUES
from .cortex import values_of_vertices as values_of_vertices
from .vtk_writer import write_vtk_xml as write_vtk_xml
