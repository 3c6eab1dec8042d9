"""Border lines between regions: which edges they follow, and how wide they are."""

from __future__ import annotations

import math

import numpy as np

from .._types import Ints
from ..cells.face_graph import FaceGraph
from ..mesh.faces import FaceMesh, ends_of_sides
from .camera import Camera

# Width of a border, as a share of the diameter of a region. Half of the line is on either side, so
# that it covers 4 % of a round region.
_SHARE_OF_REGION = 0.02

# Width, as a share of the picture's height, that larger regions do not exceed.
_SHARE_OF_PICTURE = 1 / 250

# Width in pixels below which lines break up into dots, however small the regions are.
_LEAST_WIDTH = 0.6


def border_edges(mesh: FaceMesh, graph: FaceGraph, labels: Ints) -> Ints:
    """Ends, (B, 2), of the edges between faces of different labels, each pair of faces once."""
    sources = np.repeat(np.arange(mesh.n_faces, dtype=np.int32), np.diff(graph.offsets))
    between = (labels[sources] != labels[graph.neighbors]) & (sources < graph.neighbors)
    faces, sides = sources[between], graph.sides[between]
    return ends_of_sides(mesh, faces, sides)


def default_border_width(mean_area: float, camera: Camera, height: int) -> float:
    """Width in pixels, >= 0.6, for regions of this mean area on a picture of this height.

    The diameter is that of a disk of the area, seen face on at the middle of the mesh.
    """
    distance = float(np.linalg.norm(camera.position - camera.target))
    pixels_per_unit = height / (2 * camera.half_slope * distance)
    diameter = math.sqrt(4 * mean_area / math.pi) * pixels_per_unit
    widest = max(1.0, _SHARE_OF_PICTURE * height)
    return max(_LEAST_WIDTH, min(widest, _SHARE_OF_REGION * diameter))
