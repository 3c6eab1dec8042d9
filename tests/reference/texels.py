"""Stage 2: compute mean colors in triangles of a texture. A texel is a pixel of the texture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from superfacets.base.types import Bytes, Floats
from superfacets_textures.texels import LINEAR

Position = tuple[float, float]
"""Coordinates (x, y) in an image, in texels or as texture coordinates."""

Light = tuple[float, float, float]
"""Red, green and blue of a color, in linear light."""


def texel_colors(
    pixels: Bytes, pairs: Floats, wrap: tuple[str, str] = ("repeat", "repeat")
) -> tuple[Floats, Floats]:
    """Return the mean color (N, 3) and the spread (N,) of the texels in triangles (N, 3, 2).

    Texels are used if their centers are in the triangle. In large triangles, only every n-th row
    and column is used. If a triangle contains no center of a used texel, colors are interpolated at
    the centroids of k x k equal parts of the triangle. If a coordinate is not finite, or its
    absolute value exceeds 2**20, the results are NaN.
    """
    found = [_color(pixels, triangle, wrap) for triangle in pairs.tolist()]
    return np.array([mean for mean, _ in found]), np.array([spread for _, spread in found])


def _color(pixels: Bytes, pairs: list[Position], wrap: tuple[str, str]) -> tuple[Light, float]:
    height, width, _ = pixels.shape
    u, v = [u for u, _ in pairs], [1.0 - v for _, v in pairs]
    if not all(abs(value) <= 2**20 for value in (*u, *v)):
        return (math.nan, math.nan, math.nan), math.nan
    xs = [value * width for value in _near(u, wrap[0])]
    ys = [value * height for value in _near(v, wrap[1])]
    corners = list(zip(xs, ys, strict=True))
    light_of = partial(_light_of, pixels, wrap)
    lights = [light_of(x, y) for x, y in _covered(corners)]
    if not lights:
        lights = [_between(light_of, *position) for position in _middles(corners)]
    return _mean_and_spread(lights)


def _near(values: list[float], wrap: str) -> list[float]:
    """Shift texture coordinates by an even integer, so that their minimum is in [0, 2).

    Coordinates are not shifted if `wrap` is "clamp".
    """
    shift = 0.0 if wrap == "clamp" else 2.0 * math.floor(min(values) / 2.0)
    return [value - shift for value in values]


def _light_of(pixels: Bytes, wrap: tuple[str, str], x: int, y: int) -> list[float]:
    height, width, _ = pixels.shape
    row, column = _wrapped(y, height, wrap[1]), _wrapped(x, width, wrap[0])
    light: list[float] = LINEAR[pixels[row, column]].astype(np.float64).tolist()
    return light


def _wrapped(i: int, size: int, wrap: str) -> int:
    if wrap == "clamp":
        return min(max(i, 0), size - 1)
    period = size if wrap == "repeat" else 2 * size
    return min(i % period, period - 1 - i % period) if wrap == "mirror" else i % period


def _covered(corners: list[Position]) -> Iterator[tuple[int, int]]:
    """Yield (column, row) of the used texels whose centers are in a triangle, row by row.

    In large triangles, only every n-th row and column is used.
    """
    (ax, ay), (bx, by), (cx, cy) = corners
    area = 0.5 * abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay))
    extent = max(max(ay, by, cy) - min(ay, by, cy), max(ax, bx, cx) - min(ax, bx, cx))
    step = math.ceil(max(math.sqrt(area / 2**14), extent / 2**14, 1.0)) | 1
    first, last = math.ceil(min(ay, by, cy) - 0.5), math.floor(max(ay, by, cy) - 0.5)
    for y in range(first + -first % step, last + 1, step):
        cuts = list(_cuts(corners, y + 0.5))
        if cuts:
            begin, end = math.ceil(min(cuts) - 0.5), math.floor(max(cuts) - 0.5)
            yield from ((x, y) for x in range(begin + -begin % step, end + 1, step))


def _cuts(corners: list[Position], y: float) -> Iterator[float]:
    """Yield the x coordinates at which the sides of a triangle cross the horizontal line at y."""
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        (ax, ay), (bx, by) = (b, a) if b[1] < a[1] else (a, b)
        if ay != by and ay <= y <= by:
            yield ax + (y - ay) * ((bx - ax) / (by - ay))


def _middles(corners: list[Position]) -> Iterator[Position]:
    """Yield the centroids of n x n equal parts of a triangle.

    n is the length of the longest side in texels, rounded up, from 1 to 16.
    """
    (ax, ay), (bx, by), (cx, cy) = corners
    sides = [(bx - ax, by - ay), (cx - bx, cy - by), (ax - cx, ay - cy)]
    n = math.ceil(min(max(*(math.hypot(*side) for side in sides), 1.0), 16.0))
    for i in range(n):
        for j in range(n - i):
            for third in (1, 2) if i + j + 1 < n else (1,):
                s, t = (i + third / 3) / n, (j + third / 3) / n
                yield ax + s * (bx - ax) + t * (cx - ax), ay + s * (by - ay) + t * (cy - ay)


def _between(light_of: Callable[[int, int], list[float]], x: float, y: float) -> list[float]:
    """Return the color at (x, y) by bilinear interpolation of the four nearest texels."""
    left, upper = math.floor(x - 0.5), math.floor(y - 0.5)
    right_weight, lower_weight = x - 0.5 - left, y - 0.5 - upper
    rows = [
        [
            a + right_weight * (b - a)
            for a, b in zip(light_of(left, row), light_of(left + 1, row), strict=True)
        ]
        for row in (upper, upper + 1)
    ]
    return [a + lower_weight * (b - a) for a, b in zip(*rows, strict=True)]


def _mean_and_spread(lights: list[list[float]]) -> tuple[Light, float]:
    """Return the mean and the standard deviation of colors, scaled to the range 0 to 1.

    Differences from the first color are summed, so the deviation of equal colors is exactly 0.
    """
    first, count = lights[0], len(lights)
    sums, squares = [0.0, 0.0, 0.0], 0.0
    for light in lights:
        for i in range(3):
            difference = light[i] - first[i]
            sums[i] += difference
            squares += difference * difference
    means = [total / count for total in sums]
    variance = squares / count
    for mean in means:
        variance -= mean * mean
    red, green, blue = ((start + mean) / 65535.0 for start, mean in zip(first, means, strict=True))
    return (red, green, blue), math.sqrt(max(variance, 0.0)) / 65535.0
