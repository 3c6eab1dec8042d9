"""Draw pictures of meshes and their regions, without a display."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import BorderCut, cut_borders, kit
from superfacets.kit import Bools, Cells, FaceMesh, Ints

from .backend import ensure_gl, import_pillow, import_vtk
from .camera import CLIPS, Camera, Clip, View
from .colors import face_colors
from .drawing import MAX_SIDE, draw
from .scene import (
    Picture,
    Scene,
    build_cloud_scene,
    build_scene,
    checked_colors,
    default_border_width,
    given_labels,
)

_PNG_RUNS = 3  # the strategy Z_RLE of zlib, which is fast: it compresses only runs of equal bytes


@dataclass(frozen=True)
class Style:
    """Size, viewpoint and style of a picture."""

    frame: tuple[int, int]  # width and height in pixels
    view: View
    border_width: float | None  # in pixels; None for the width from `default_border_width`
    background: tuple[int, int, int]
    has_numbers: bool  # whether labels are written on regions
    hides_backs: bool  # whether triangles seen from behind are hidden

    @property
    def aspect(self) -> float:
        """Width of the picture divided by its height."""
        return self.frame[0] / self.frame[1]


def checked_style(
    size: tuple[int, int], view: View | str | None, border_width: float | None, background: str,
    *, numbers: bool, hides_backs: bool,
) -> Style:  # fmt: skip
    """Check arguments of `plot`, and return them as a `Style`."""
    frame = (_checked_side(size, 0), _checked_side(size, 1))
    view = _checked_view(view)
    if border_width is not None:
        border_width = kit.checked_number(border_width, "border_width", zero=True)
    has_numbers = kit.checked_flag(numbers, "numbers")
    color = _checked_background(background)
    return Style(frame, view, border_width, color, has_numbers, hides_backs)


def checked_see_inside(see_inside: bool, cells: Cells) -> bool:
    """Check `see_inside` (see `plot`), and return it."""
    if not kit.checked_flag(see_inside, "see_inside"):
        return False
    if not kit.kind_of(cells).has_fronts(cells):
        raise ValueError(
            "see_inside needs a cloud with normals or viewpoints, but this cloud has neither"
        )
    return True


def scene_of(
    cells: Cells, labels: npt.ArrayLike | None, colors: npt.ArrayLike | None, clip: Clip | None,
    *, is_smooth: bool = False,
) -> Scene:  # fmt: skip
    """Build the scene of a mesh or a cloud; see `plot` for the parameters."""
    kind = kit.kind_of(cells)
    keep = None if clip is None else _half(cells, clip)
    drawn = kind.drawn_faces(cells, keep)
    if drawn is None:
        return build_cloud_scene(kind.cloud(cells), labels, colors)
    surface, sources = drawn
    if sources is None:
        return _surface_scene(surface, labels, colors, is_smooth=is_smooth)
    if labels is not None:
        labels, ids = kit.compact_partial_labels(
            labels, cells.n_cells, getattr(cells, "n_vertices", None)
        )
        # Colors are chosen for the whole volume, so that they do not depend on `clip`.
        colors = face_colors(cells, labels) if colors is None else colors
        labels = given_labels(labels[sources], ids)
    if colors is not None:
        colors = checked_colors(colors, cells.n_cells)[sources]
    return _surface_scene(surface, labels, colors, is_smooth=is_smooth)


def _surface_scene(
    surface: FaceMesh, labels: npt.ArrayLike | None, colors: npt.ArrayLike | None,
    *, is_smooth: bool,
) -> Scene:  # fmt: skip
    """Build the scene of a surface; if `is_smooth`, faces are cut along smooth borders."""
    if labels is None or not is_smooth:
        return build_scene(surface, labels, colors)
    compact, ids = kit.compact_partial_labels(labels, surface.n_faces, surface.n_vertices)
    if not len(ids):
        return build_scene(surface, labels, colors)
    given = face_colors(surface, compact) if colors is None else colors
    shades = checked_colors(given, surface.n_faces)
    cut = cut_borders(surface, compact)
    colors = _colors_of_parts(cut, compact, shades)
    return build_scene(cut.mesh, given_labels(cut.labels, ids), colors)


def _colors_of_parts(cut: BorderCut, labels: Ints, shades: Picture) -> Picture:
    """Return the color of each face after the cut, (F', 3), given the colors of the old faces.

    If all old faces of a region have the same color, its new faces get this color. Otherwise, each
    new face gets the color of the old face that contains it.
    """
    old, new = labels + 1, cut.labels + 1  # 0: the face is in no region
    firsts = np.zeros(old.max() + 1, dtype=np.int64)
    firsts[old[::-1]] = np.arange(len(old))[::-1]
    is_plain = np.ones(len(firsts), dtype=bool)
    is_plain[old[(shades != shades[firsts[old]]).any(axis=1)]] = False
    return shades[np.where(is_plain[new], firsts[new], cut.sources)]


def _half(cells: Any, clip: Clip) -> Bools:
    """Return whether the centroid of each cell is in the half of the bounding box named `clip`."""
    kit.checked_choice(clip, "clip", CLIPS)
    kind = kit.kind_of(cells)
    if kind.dimension != 3:
        noun = "a surface has" if kind.has_faces else f"{kind.plural} have"
        raise ValueError(f"omit clip: it is only for tetrahedra, and {noun} no interior")
    axis = "xyz".index(clip[-1])
    heights = kind.positions(cells)[:, axis] - cells.bounds[:, axis].mean()
    return np.asarray(heights < 0 if clip.startswith("-") else heights >= 0)


def draw_scene(scene: Scene, cameras: list[Camera], style: Style) -> list[Picture]:
    """Return a picture of the scene for each camera.

    All cameras must have the same distance from their targets, because border lines have the same
    width in all pictures. Raises a ValueError if the style has numbers, but the scene no labels.
    """
    if style.has_numbers and scene.labels is None:
        raise ValueError(
            "numbers shows the label of each region, but no labels are given: give labels too"
        )
    width = style.border_width
    if width is None:
        width = default_border_width(scene.mean_region_area, cameras[0], style.frame[1])
    return draw(
        scene, cameras, style.frame, width, style.background, has_numbers=style.has_numbers,
        hides_backs=style.hides_backs,
    )  # fmt: skip


def png_of_picture(picture: Picture) -> bytes:
    """Encode a picture as PNG.

    The strategy `_PNG_RUNS` is three times as fast as the default strategy of zlib.
    """
    file = io.BytesIO()
    image = import_pillow("Image").fromarray(picture)
    image.save(file, format="PNG", compress_level=4, compress_type=_PNG_RUNS)
    return file.getvalue()


def check_rendering() -> None:
    """Raise the same error as `plot` if VTK, Pillow or OpenGL is missing."""
    import_vtk()
    import_pillow("Image")
    ensure_gl()


def _checked_view(view: View | str | None) -> View:
    if isinstance(view, str):
        return View.named(view)
    if view is not None and not isinstance(view, View):
        raise TypeError(f"view must be a superfacets.View or the name of a view, got {view!r}")
    return view or View()


def _checked_side(size: tuple[int, int], side: int) -> int:
    """Check and return the width (`side` 0) or the height (`side` 1) in pixels."""
    if not isinstance(size, (tuple, list)) or len(size) != 2:
        raise ValueError(f"size must be (width, height), got {size!r}")
    count = kit.checked_count(size[side], "size")
    if count > MAX_SIDE:
        raise ValueError(f"width and height in size must be at most {MAX_SIDE}, got {count}")
    return count


def checked_picture_path(output: str | os.PathLike[str], endings: Sequence[str]) -> Path:
    """Return `output` as a path.

    Raises a ValueError if its ending is not in `endings`, or an OSError if the file cannot be
    written.
    """
    path = Path(output)
    if path.suffix.lower() not in endings:
        raise ValueError(f"output must end in {' or '.join(endings)}, got {path.name!r}")
    kit.checked_targets([path])
    return path


def _checked_background(background: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255, of a color, which is a CSS name or "#rrggbb"."""
    try:
        red, green, blue, *_ = import_pillow("ImageColor").getrgb(background)
    except (ValueError, TypeError, AttributeError):
        raise ValueError(
            f'background must be the name of a color or "#rrggbb", got {background!r}'
        ) from None
    return red, green, blue
