"""Find the triangles that a camera sees, and group regions that are often in the same masks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from superfacets.base.types import Array, Bools, Floats, Ints
from superfacets.mesh.meshes import Mesh
from superfacets_scans.pinhole_camera import PinholeCamera

from .arithmetic import dot

MAX_STRETCHED = 10.0
"""Maximum surface area in a pixel, in multiples of the area of a surface at the same depth that
faces the camera. A larger area is set to 0, because the surface is seen at a very small angle."""


def see_surface(mesh: Mesh, camera: PinholeCamera) -> tuple[Ints, Floats, Bools]:
    """Return the triangle seen in each pixel, its area in the pixel, and which triangles are seen.

    Pixels without a triangle have the index -1 and the area 0. A triangle is seen if it has an area
    > 0 in a pixel, or if its centroid is in the image and, within a tolerance, not behind the
    surface in its pixel.

    The ray of each pixel is intersected with each triangle. Vertices are mapped to (u d, v d, d),
    where (u, v) is the position in the image and d the depth. This map is linear, so triangles stay
    flat and depths can be interpolated.
    """
    width, height = camera.size
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    positions = [_projected(camera.projection, vertex) for vertex in mesh.vertices]
    triangles = np.full((height, width), -1, np.int32)
    depths = np.full((height, width), np.inf)
    areas = np.zeros((height, width))
    focal_product = camera.intrinsics[0] * camera.intrinsics[1]
    for face, corners in enumerate(mesh.faces):
        a, b, c = (positions[corner] for corner in corners)
        sides = [np.cross(b, c), np.cross(c, a), np.cross(a, b)]
        volume = dot(a, sides[0])
        if volume == 0:  # the plane of the triangle contains the camera
            continue
        if volume < 0:
            volume, sides = -volume, [-side for side in sides]
        heights = [side[0] * u + (side[1] * v + side[2]) for side in sides]
        is_hit = np.logical_and.reduce([one >= 0 for one in heights])
        with np.errstate(divide="ignore"):
            depth = np.where(is_hit, volume / ((heights[0] + heights[1]) + heights[2]), np.inf)
        is_nearer = depth < depths
        triangles[is_nearer], depths[is_nearer] = face, depth[is_nearer]
        a, b, c = mesh.vertices[corners]
        normal = np.cross(b - a, c - a)
        squared = depths[is_nearer] * depths[is_nearer]
        area = math.sqrt(dot(normal, normal)) * (squared * depths[is_nearer]) / volume
        is_flat = area > MAX_STRETCHED * (squared / focal_product)
        areas[is_nearer] = np.where(is_flat, 0, area)
    seen = np.zeros(mesh.n_faces, bool)
    seen[triangles[areas > 0]] = True
    for face, corners in enumerate(mesh.faces):
        total = (positions[corners[0]] + positions[corners[1]]) + positions[corners[2]]
        if total[2] > 0 and 0 <= total[0] / total[2] < width and 0 <= total[1] / total[2] < height:
            pixel = int(total[1] / total[2]), int(total[0] / total[2])
            length = areas[pixel] * math.sqrt(focal_product) / depths[pixel]
            seen[face] |= areas[pixel] > 0 and total[2] / 3 <= depths[pixel] + length
    return triangles, areas, seen


def _projected(projection: Floats, point: Floats) -> Floats:
    x, y, z = point
    return np.array([(m[0] * x + m[1] * y) + (m[2] * z + m[3]) for m in projection])


def join_by_masks(areas: Sequence[Floats], least: float) -> list[int]:
    """Group regions that are often in the same masks, and return the group of each region.

    `areas` contains one array (K, M) per image: the area of each region in each mask. At first,
    each region is a group. The two groups with the highest agreement are merged repeatedly, while
    their agreement is at least `least`. The agreement is a fraction. Its numerator is the sum, over
    all masks of all images, of the product of the areas of both groups in the mask. Its denominator
    is the sum, over all images, of the product of the total areas of both groups in the image. Of
    pairs with equal agreements, pairs of older groups and of lower regions are merged first. Groups
    are numbered by their lowest region.
    """
    members = {region: [region] for region in range(len(areas[0]))}
    rows = {region: [image[region] for image in areas] for region in members}
    while True:
        pairs = [(-_agreement(rows[a], rows[b]), a, b) for a, b in combinations(sorted(rows), 2)]
        best, a, b = min(pairs, default=(0.0, 0, 0))
        if -best < least:
            break
        joined = len(members)
        members[joined] = members[a] + members[b]
        rows[joined] = [x + y for x, y in zip(rows.pop(a), rows.pop(b), strict=True)]
    group_of = {region: group for group in sorted(rows) for region in members[group]}
    firsts = sorted({group: min(members[group]) for group in rows}.items(), key=lambda it: it[1])
    number = {group: index for index, (group, _) in enumerate(firsts)}
    return [number[group_of[region]] for region in range(len(areas[0]))]


def _agreement(one: list[Array], other: list[Array]) -> float:
    same = sum(float((x * y).sum()) for x, y in zip(one, other, strict=True))
    both = sum(float(x.sum() * y.sum()) for x, y in zip(one, other, strict=True))
    return same / both if both > 0 else 0.0
