"""Slow, readable versions of functions of the C++ core, which tests compare with the core.

On the same input, most functions in this package and their compiled versions return bit-identical
numbers, because they add floats in the same order and compute arctangents and exponentials without
the C library (see `arithmetic`). Only rounding errors may differ in `measure_polygons`,
`build_point_graph`, `point_normals`, `region_shapes`, `region_arcs`, `ray_thickness` and
`smallest_eigenpairs`.

The module `vsa` implements variational shape approximation, an alternative to stages 3 and 4.
"""

from .cells import build_face_graph as build_face_graph
from .cells import build_point_graph as build_point_graph
from .cells import build_tet_graph as build_tet_graph
from .cells import measure_faces as measure_faces
from .cells import measure_polygons as measure_polygons
from .cells import point_normals as point_normals
from .clustering import classify_exact as classify_exact
from .clustering import classify_halted as classify_halted
from .clustering import coarse_arcs as coarse_arcs
from .clustering import coarse_cells as coarse_cells
from .clustering import iterate as iterate
from .clustering import join_islands as join_islands
from .clustering import relocate_centers as relocate_centers
from .region_sizes import move_cells as move_cells
from .region_sizes import walk_regions as walk_regions
from .regions import find_bridges as find_bridges
from .regions import merge_tree as merge_tree
from .regions import region_arcs as region_arcs
from .regions import region_shapes as region_shapes
from .seeding import curve_seeds as curve_seeds
from .seeding import farthest_seeds as farthest_seeds
from .seeding import find_components as find_components
from .seeding import flood_seeds as flood_seeds
from .seeding import geodesic_seeds as geodesic_seeds
from .seeding import grid_seeds as grid_seeds
from .seeding import update_centers as update_centers
from .smooth import smooth_borders as smooth_borders
from .spatial import nearest_faces as nearest_faces
from .spatial import nearest_tets as nearest_tets
from .spatial import ray_thickness as ray_thickness
from .spatial import subdivide as subdivide
from .texels import texel_colors as texel_colors
from .vertices import count_segments as count_segments
from .vertices import mean_normals as mean_normals
from .vertices import share_vertices as share_vertices
from .vertices import spread_labels as spread_labels
from .views import join_by_masks as join_by_masks
from .views import see_surface as see_surface
from .weights import quantize_weights as quantize_weights
from .weights import smallest_eigenpairs as smallest_eigenpairs
from .weights import superfacet_weights as superfacet_weights
