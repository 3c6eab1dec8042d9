"""Public names, and names that other apps use."""

from .cortex import label_names as label_names
from .tet_graph import TetGraph as TetGraph
from .tet_graph import TriangleCounts as TriangleCounts
from .tet_graph import build_tet_graph as build_tet_graph
from .tet_mesh import TetBoundary as TetBoundary
from .vtk_writer import write_vtk_xml as write_vtk_xml
