"""Draw titles above pictures, a color scale below pictures, and numbers on regions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from superfacets.kit import Array, Ints, Longs

from .backend import import_pillow
from .colors import NO_COLOR, Scale, scale_colors
from .scene import Picture

TITLE_SHARE, SCALE_SHARE = 0.07, 0.12
"""Heights of the title strip and of the scale strip, as fractions of the height of the picture."""

# Heights of the text and of the color bar, as fractions of the height of the scale strip; width of
# the color bar, as a fraction of the width of the strip.
_TEXT, _BAR, _BAR_WIDTH = 0.26, 0.22, 0.5

# Maximum number of intervals between ticks. Intervals are 1, 2 or 5 times a power of ten.
_MAX_TICKS = 6
_STEPS = (1, 2, 5, 10)
_TINY = 1e-290  # smaller ranges get ticks only at their ends, because steps would underflow

# Height of numbers on regions: a fraction of the mean diameter of visible regions; its minimum in
# pixels; its maximum as a fraction of the picture's height.
_NUMBER, _MIN_NUMBER, _MAX_NUMBER = 0.3, 10.0, 1 / 32

# Minimum clearance of a number's center in pixels: regions seen edge-on are one or two pixels wide.
_MIN_ROOM = 3

# Clearance that suffices for a number, as a fraction of the largest clearance in its region. The
# height of the number also suffices.
_WIDE = 0.8

# Width of the outline of numbers, as a fraction of their height.
_OUTLINE = 0.12

_DARK, _LIGHT = (28, 28, 32), (255, 255, 255)

Color = tuple[int, int, int]


def title_strip(titles: Sequence[str], width: int, height: int, background: Color) -> Picture:
    """Draw a strip with one title per picture, centered above the picture of width `width`."""
    image, pen = _canvas(width * len(titles), height, background)
    for i, title in enumerate(titles):
        font = _fitting_font(title, 0.55 * height, 0.96 * width)
        middle = ((i + 0.5) * width, 0.55 * height)
        pen.text(middle, title, fill=_ink(background), font=font, anchor="mm")
    return np.asarray(image)


def scale_strip(scale: Scale, width: int, height: int, background: Color) -> Picture:
    """Draw the title, color bar and ticks of a color scale.

    If some values are missing, a gray box with the text "none" is drawn beside the color bar.
    """
    image, pen = _canvas(width, height, background)
    ink, font = _ink(background), _font(_TEXT * height)
    left, right = round(width * (0.5 - _BAR_WIDTH / 2)), round(width * (0.5 + _BAR_WIDTH / 2))
    top, bottom = round(0.36 * height), round((0.36 + _BAR) * height)
    row = scale_colors(max(1, right - left))[np.newaxis]
    bar = np.repeat(row, max(1, bottom - top), axis=0)
    image.paste(import_pillow("Image").fromarray(bar), (left, top))
    pen.text((width / 2, 0.17 * height), scale.title, fill=ink, font=font, anchor="mm")
    ticks = _ticks(scale.low, scale.high)
    for value, share in zip(ticks, scale.shares(np.array(ticks)), strict=True):
        x = left + (right - left) * float(share)
        pen.line([(x, bottom), (x, bottom + 0.07 * height)], fill=ink)
        pen.text((x, 0.8 * height), f"{value:.6g}", fill=ink, font=font, anchor="mm")
    if scale.has_missing:
        side = bottom - top
        box = right + 1.5 * side
        pen.rectangle([box, top, box + side, bottom], fill=NO_COLOR)
        middle = (box + 1.4 * side, (top + bottom) / 2)
        pen.text(middle, "none", fill=ink, font=font, anchor="lm")
    return np.asarray(image)


def draw_numbers(picture: Picture, regions: Ints, names: Array) -> Picture:
    """Write the name of each visible region on the picture, dark with a light outline.

    `regions` contains the region of each pixel, (height, width), or -1 for no region; `names`
    contains a number for each region. Numbers do not overlap: if the numbers of larger regions
    leave no room, the number of a region is left out.
    """
    counts = np.bincount(regions.ravel() + 1, minlength=len(names) + 1)[1:]
    diameter = math.sqrt(4 / math.pi * counts.sum() / max(1, np.count_nonzero(counts)))
    size = max(_MIN_NUMBER, min(_NUMBER * diameter, _MAX_NUMBER * len(picture)))
    outline, font = max(1, round(_OUTLINE * size)), _font(size)
    image = import_pillow("Image").fromarray(picture)
    pen = import_pillow("ImageDraw").Draw(image)
    texts = [str(name) for name in names]
    widths = [math.ceil(font.getlength(text)) + 2 * outline for text in texts]
    for region, row, column in _places(regions, counts, math.ceil(size), widths):
        pen.text(
            (column + 0.5, row + 0.5), texts[region], fill=_DARK, font=font, anchor="mm",
            stroke_width=outline, stroke_fill=_LIGHT,
        )  # fmt: skip
    return np.asarray(image)


def _places(
    regions: Ints, counts: Longs, height: int, widths: Sequence[int]
) -> Iterator[tuple[int, int, int]]:
    """Yield region, row and column of the center of each number, the largest region first.

    `counts` is the number of pixels of each region; the number of a region is `height` pixels high
    and `widths[region]` pixels wide. Of all free pixels with enough clearance in the region, the
    center is the pixel nearest to the centroid of the region's pixels.
    """
    rooms = _clearances(regions)
    rooms[rooms < _MIN_ROOM] = 0
    order = np.argsort(regions.ravel(), kind="stable")
    ends = len(order) - counts.sum() + np.cumsum(counts)
    for region in np.argsort(-counts, kind="stable").tolist():
        pixels = order[ends[region] - counts[region] : ends[region]]
        free = rooms.ravel()[pixels]
        if not free.any():
            continue
        rows, columns = np.divmod(pixels, regions.shape[1])
        distances = np.hypot(rows - rows.mean(), columns - columns.mean())
        place = np.where(free >= min(height, _WIDE * free.max()), distances, np.inf).argmin()
        row, column = int(rows[place]), int(columns[place])
        yield region, row, column
        reach = (widths[region] + max(widths)) // 2
        above, left = max(0, row - height), max(0, column - reach)
        rooms[above : row + height + 1, left : column + reach + 1] = 0


def _clearances(regions: Ints) -> Longs:
    """Return the number of pixels from each pixel to the end of its region, >= 1.

    The number is the minimum over the directions left, right, up and down, and includes the pixel.
    """
    room = np.full(regions.shape, max(regions.shape), dtype=np.int64)
    for turns in range(4):
        turned, least = np.rot90(regions, turns), np.rot90(room, turns)
        columns = np.arange(1, turned.shape[1] + 1)
        is_new = np.ones(turned.shape, dtype=bool)
        is_new[:, 1:] = turned[:, 1:] != turned[:, :-1]
        starts = np.maximum.accumulate(np.where(is_new, columns, 0), axis=1)
        np.minimum(least, columns - starts + 1, out=least)  # writes into `room`
    return room


def _canvas(width: int, height: int, background: Color) -> tuple[Any, Any]:
    """Create an image; return the image, and an object that draws on the image."""
    image = import_pillow("Image").new("RGB", (width, height), background)
    return image, import_pillow("ImageDraw").Draw(image)


def _ink(background: Color) -> Color:
    """Return the text color: white on a dark background, otherwise nearly black."""
    is_dark = 0.299 * background[0] + 0.587 * background[1] + 0.114 * background[2] < 128
    return _LIGHT if is_dark else _DARK


def _font(size: float) -> Any:
    """Return Pillow's default font in a size given in pixels."""
    return import_pillow("ImageFont").load_default(max(1.0, size))


def _fitting_font(text: str, size: float, width: float) -> Any:
    """Return the font in the largest size, up to `size`, for which `text` fits into `width`."""
    font = _font(size)
    length = font.getlength(text)
    return font if length <= width else _font(size * width / length)


def _ticks(low: float, high: float) -> list[float]:
    """Return the ticks of the scale: round numbers from low to high.

    If the difference of low and high is below `_TINY` or overflows, only low and high are returned.
    """
    if not _TINY < high - low < math.inf:
        return sorted({low, high})
    least = (high - low) / _MAX_TICKS
    power = 10.0 ** math.floor(math.log10(least))
    step = next(factor * power for factor in _STEPS if factor * power >= least)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [i * step for i in range(first, last + 1)]
