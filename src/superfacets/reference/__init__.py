"""A slow, readable twin of every kernel, one file per stage: the oracle of the tests.

On the same input the compiled stages give the same numbers, bit for bit. Floats are added in the
order of the kernels, which is part of the contract. Nothing here is meant to be fast. `arithmetic`
has the arctangent and the exponential. `vsa` has variational shape approximation, a rival of stages
3 and 4.
"""

from .cells import (
    Arc,
    build_face_graph,
    build_point_graph,
    build_tet_graph,
    measure_faces,
    measure_polygons,
    point_normals,
)
from .clustering import (
    classify_exact,
    classify_halted,
    coarse_arcs,
    coarse_cells,
    iterate,
    join_islands,
    relocate_centers,
    second_nearest,
)
from .region_sizes import move_cells, walk_regions
from .regions import RegionArc, find_bridges, merge_tree, region_arcs, region_shapes
from .seeding import (
    curve_seeds,
    farthest_seeds,
    find_components,
    flood_seeds,
    geodesic_seeds,
    grid_seeds,
    update_centers,
)
from .smooth import smooth_borders
from .spatial import (
    Part,
    nearest_faces,
    nearest_in_tet,
    nearest_on_triangle,
    nearest_tets,
    ray_thickness,
    subdivide,
)
from .texels import texel_colors
from .vertices import count_segments, mean_normals, spread_labels
from .views import join_by_masks, see_surface
from .weights import quantize_weights, smallest_eigenpairs, superfacet_weights

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
    "count_segments",
    "curve_seeds",
    "farthest_seeds",
    "find_bridges",
    "find_components",
    "flood_seeds",
    "geodesic_seeds",
    "grid_seeds",
    "iterate",
    "join_by_masks",
    "join_islands",
    "mean_normals",
    "measure_faces",
    "measure_polygons",
    "merge_tree",
    "move_cells",
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
    "see_surface",
    "smallest_eigenpairs",
    "smooth_borders",
    "spread_labels",
    "subdivide",
    "superfacet_weights",
    "texel_colors",
    "update_centers",
    "walk_regions",
]
