"""A slow, readable twin of every kernel, one file per stage: the oracle of the tests.

On the same input the compiled stages give the same numbers, bit for bit. Where floats are added,
the order is that of the kernels and part of the contract. Nothing here is meant to be fast.
`elementary` has the arctangent and the exponential, `vsa` the rival of stages 3 and 4.
"""

from .classification import classify_exact, classify_halted, join_islands
from .coarsening import coarse_arcs, coarse_cells
from .eigenvectors import smallest_eigenpairs
from .face_graph import Arc, build_face_graph, build_tet_graph, measure_faces, measure_polygons
from .graphs import find_components
from .loop import iterate
from .merging import find_bridges, merge_tree
from .nearest import nearest_faces, nearest_in_tet, nearest_on_triangle, nearest_tets
from .point_graph import build_point_graph, point_normals
from .region_graph import RegionArc, region_arcs, region_shapes
from .relocation import relocate_centers, second_nearest
from .seeding import farthest_seeds, flood_seeds, geodesic_seeds, grid_seeds
from .smooth import smooth_borders
from .subdivision import Part, subdivide
from .thickness import ray_thickness
from .update import update_centers
from .weights import quantize_weights, superfacet_weights

__all__ = [
    "Arc",
    "Part",
    "RegionArc",
    "build_face_graph",
    "build_point_graph",
    "build_tet_graph",
    "classify_exact",
    "classify_halted",
    "coarse_arcs",
    "coarse_cells",
    "farthest_seeds",
    "find_bridges",
    "find_components",
    "flood_seeds",
    "geodesic_seeds",
    "grid_seeds",
    "iterate",
    "join_islands",
    "measure_faces",
    "measure_polygons",
    "merge_tree",
    "nearest_faces",
    "nearest_in_tet",
    "nearest_on_triangle",
    "nearest_tets",
    "point_normals",
    "quantize_weights",
    "ray_thickness",
    "region_arcs",
    "region_shapes",
    "relocate_centers",
    "second_nearest",
    "smallest_eigenpairs",
    "smooth_borders",
    "subdivide",
    "superfacet_weights",
    "update_centers",
]
