"""Draw pictures of several labelings side by side, with a color scale, or of a rotating mesh."""

from __future__ import annotations

import base64
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import Hierarchy, RegionGraph, Segmentation, kit, region_graph
from superfacets.kit import Array, Cells, Floats, MeshLike

from .animation import MOVING_ENDINGS, check_video, gif_of, write_video
from .annotations import SCALE_SHARE, TITLE_SHARE, scale_strip, title_strip
from .backend import import_vtk
from .camera import Clip, Up, View, orbiting_cameras, place_camera
from .colors import Scale, checked_values, scale_of
from .rendering import (
    Style,
    checked_picture_path,
    checked_see_inside,
    checked_style,
    draw_scene,
    png_of_picture,
    scene_of,
)
from .scene import MOST_CUT, Picture, surface_of, upright

_SIZE, _MOVING_SIZE = (1200, 900), (640, 480)

_N_FRAMES = 60

_ENDINGS = (".png", *MOVING_ENDINGS)


@dataclass(frozen=True, eq=False)
class Plot:
    """Result of `plot`: one picture, or the pictures of a rotation around the up axis.

    A notebook shows the plot if it is the last expression in a code cell; ``save(path)`` writes it.
    ``numpy.asarray`` returns the first picture.

    Attributes
    ----------
    frames : list of ndarray of uint8, shape (height, width, 3)
        One picture, or all pictures of a rotation, in sRGB. Row 0 is at the top.
    up : {"y", "z", "x"}
        Axis that points up. If the view has ``up="auto"``, this is the guessed axis.
    """

    frames: list[Picture]
    up: Up

    @property
    def image(self) -> Picture:
        """First picture, shape (height, width, 3)."""
        return self.frames[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return the first picture."""
        return np.array(self.image, dtype=dtype, copy=copy is not False)

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        is_single, pictures = len(self.frames) == 1, kit.counted(len(self.frames), "picture")
        ending = ".png" if is_single else ".gif or .mp4"
        return (
            f"Plot({pictures} of {width} x {height} pixels: shown by a notebook, or written by"
            f" .save(path) to a {ending} file)"
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write one picture as .png, or a rotation as .gif or .mp4, and return the path.

        The file is written atomically.

        Raises
        ------
        ValueError
            If the path has another ending, or if the ending does not match the number of pictures:
            one for .png, several for .gif and .mp4.
        RenderError
            If the path ends in .mp4 and imageio-ffmpeg is not installed.
        OSError
            If the file cannot be written.
        """
        target = _checked_target(path, len(self.frames))
        with kit.atomic_outputs([target]) as (partial,):
            if target.suffix.lower() == ".mp4":
                write_video(self.frames, partial)
            else:
                partial.write_bytes(self._content())
        return target

    def _content(self) -> bytes:
        return png_of_picture(self.image) if len(self.frames) == 1 else gif_of(self.frames)

    def _repr_png_(self) -> bytes | None:
        """Return a single picture as PNG, or None for a rotation."""
        return self._content() if len(self.frames) == 1 else None

    def _repr_html_(self) -> str | None:
        """Return a rotation as HTML, or None for a single picture."""
        if len(self.frames) == 1:
            return None
        data = base64.b64encode(self._content()).decode("ascii")
        return f'<img alt="A rotating mesh" src="data:image/gif;base64,{data}">'


def plot(
    mesh: MeshLike,
    labels: npt.ArrayLike | Segmentation | Hierarchy | None = None,
    output: str | os.PathLike[str] | None = None,
    *,
    compare: Sequence[npt.ArrayLike] = (),
    titles: Sequence[str] | None = None,
    colors: npt.ArrayLike | None = None,
    color_by: npt.ArrayLike | str | None = None,
    scale_title: str | None = None,
    size: tuple[int, int] | None = None,
    view: View | str | None = None,
    n_frames: int | None = None,
    border_width: float | None = None,
    background: str = "white",
    clip: Clip | None = None,
    smooth_borders: bool | None = None,
    numbers: bool = False,
    see_inside: bool = False,
) -> Plot:
    """Return a picture or animation of a mesh and its regions, for one or several labelings.

    With `output`, the picture is also written to a file. Without, a notebook shows the result.

    No display is needed: on Linux, Mesa's EGL or OSMesa is sufficient. Shading is smooth except
    across edges sharper than 40 degrees. A border is drawn on each edge between two faces with
    different labels. Vertices at exactly the same position are treated as one vertex. A file is
    written atomically. Time is linear in the number of cells, of pixels, and of pictures.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like
        Same as in `segment`. Points are drawn as small hexagons on the surface, without borders.
    labels : array_like of integers, shape (F,) or (V,), Segmentation or Hierarchy, optional
        Region of each face, tetrahedron or point, or of each vertex of a mesh: any integers. Cells
        with label -1 are gray. Without labels, a cloud with colors is drawn in its own colors,
        other clouds and all meshes in a single color. The levels of a `Hierarchy` are side by side,
        the finest first.
    output : path, optional
        File to write: .png for one picture, .gif or .mp4 for a rotation.
    compare : sequence of array_like of integers, shape (N,) each
        Additional labelings of the same cells, drawn to the right of `labels`, from the same
        viewpoint.
    titles : sequence of str, optional
        One title per labeling, drawn above its picture.
    colors : array_like of uint8, shape (F, 3), optional
        Color of each face, tetrahedron or point, sRGB. If labels are given, the default is
        `face_colors`.
    color_by : array_like of numbers, shape (N,), (K,) or (V,), or str, optional
        Values shown as colors: one value per cell; for a single labeling, one value per region, in
        ascending order of labels; one value per vertex of a mesh, averaged over the corners of each
        cell; or the name of a column of `RegionGraph.table`, for example ``"area"``. If N = V,
        values are values of cells. Blue is the lowest value, and yellow the highest. NaN values and
        cells without a region are gray. There is one color scale for all labelings, below the
        pictures.
    scale_title : str, optional
        Title of the color scale. The default is the name of the column, or no title if `color_by`
        is an array.
    size : (int, int), optional
        Width and height of each labeling's picture in pixels, at most 8192 each. The height
        includes title and color scale. The default is (1200, 900), or (640, 480) for a rotation.
    view : View or str, optional
        Viewpoint, or the name of a view for `View.named`, such as "front", "top" or "iso". The
        default is from the right and slightly above. A rotation starts at the viewpoint.
    n_frames : int, optional
        Number of pictures of one full rotation, which takes about 5 seconds; 1 for a single
        picture. The default is 60 if `output` is a .gif or .mp4, and otherwise 1.
    border_width : float, optional
        Width of borders in pixels; 0 draws no borders. The default is 2 % of the diameter of an
        average region in the picture, but at least 0.6 pixels, and at most 1/250 of the picture's
        height or 1 pixel, whichever is larger.
    background : str, default "white"
        Name of a CSS color, or "#rrggbb".
    clip : {"x", "-x", "y", "-y", "z", "-z"}, optional
        Half of a `TetMesh` to show. ``"x"`` shows the tetrahedra whose centroids have a larger x
        than the center of the bounding box, and ``"-x"`` shows the tetrahedra whose centroids have
        a smaller x. By default, the outer surface of the whole mesh is shown.
    smooth_borders : bool, optional
        Whether borders are drawn as smooth curves across faces, computed by `cut_borders`, instead
        of as lines along edges. Small pieces of a region may then vanish. The default is True if
        `labels` is a `Segmentation` of at most 500,000 cells and `compare` is empty, else False.
        Clouds are drawn without borders.
    numbers : bool, default False
        Whether the label of each visible region is written on it, near the center of its visible
        part. The label -1 is not written. Labels do not overlap: if there is no room, labels of
        small regions are left out.
    see_inside : bool, default False
        Whether surfaces seen from behind are hidden, with their borders. This shows the inside of a
        room that was scanned from inside. The corners of a face are counterclockwise as seen from
        its front. Points of a cloud are hidden if their normals face away; the cloud must have
        normals or viewpoints, which orient estimated normals.

    Returns
    -------
    Plot
        Plot with ``image``, ``frames``, ``up`` and ``save(path)``. A notebook shows the plot.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If another argument is invalid.
    MissingExtraError
        If VTK or Pillow is not installed. PyVista installs these two packages.
    RenderError
        If VTK cannot be loaded, if this machine has no OpenGL, or if imageio-ffmpeg is missing for
        an .mp4 file. The message says what to install.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> plot(square, [0, 1], view="front", size=(160, 120)).image.shape  # doctest: +SKIP
    (120, 160, 3)
    """
    whole = kit.as_cells(mesh)
    if smooth_borders is None:
        is_small = isinstance(labels, Segmentation) and whole.n_cells <= MOST_CUT
        smooth_borders = is_small and not len(compare)
    n = _n_frames(n_frames, output)
    path = None if output is None else _checked_target(output, n)
    levels = labels.levels if isinstance(labels, Hierarchy) else [labels]
    series = [kit.of_cells(each, whole) for each in (*levels, *compare)]
    _check_titles(titles, len(series))
    if color_by is not None and colors is not None:
        raise ValueError("give colors or color_by, not both")
    style = checked_style(
        size or (_SIZE if n == 1 else _MOVING_SIZE), view, border_width, background,
        numbers=numbers, hides_backs=checked_see_inside(see_inside, whole),
    )  # fmt: skip
    import_vtk()
    shades, scale = [colors] * len(series), None
    if color_by is not None:
        shades, scale = _colors_by(whole, series, color_by, scale_title)
    frames, up = _draw_side_by_side(
        _Panels(whole, series, shades, clip, kit.checked_flag(smooth_borders, "smooth_borders")),
        style, n, titles, scale,
    )  # fmt: skip
    plotted = Plot(frames, up)
    if path is not None:
        plotted.save(path)
    return plotted


def _n_frames(given: int | None, output: str | os.PathLike[str] | None) -> int:
    """Return `given` or, if it is None, the default number of pictures for the file `output`."""
    if given is not None:
        return kit.checked_count(given, "n_frames")
    is_moving = output is not None and Path(output).suffix.lower() in MOVING_ENDINGS
    return _N_FRAMES if is_moving else 1


def _checked_target(output: str | os.PathLike[str], n_frames: int) -> Path:
    """Return the path of the output file.

    Raises an error if the ending of the path does not allow `n_frames` pictures, if the file cannot
    be created, or if a package for writing videos is missing.
    """
    path = checked_picture_path(output, _ENDINGS)
    is_moving = path.suffix.lower() in MOVING_ENDINGS
    if is_moving and n_frames == 1:
        raise ValueError(f"{path.name!r} needs several pictures: n_frames must be > 1, got 1")
    if n_frames > 1 and not is_moving:
        raise ValueError(f"{path.name!r} can store only one picture: write a .gif or .mp4 file")
    if path.suffix.lower() == ".mp4":
        check_video()
    return path


def _check_titles(titles: Sequence[str] | None, n: int) -> None:
    if titles is not None and (isinstance(titles, str) or len(titles) != n):
        raise ValueError(f"titles must be a list of one title per labeling ({n}), got {titles!r}")


def _colors_by(
    cells: Cells, series: Sequence[Any], color_by: Any, title: str | None
) -> tuple[list[Any], Scale]:
    if isinstance(color_by, str):
        singular = color_by.removesuffix("s")  # the attribute of the column "area" is `areas`
        is_plural = singular in RegionGraph.column_names(kit.kind_of(cells).dimension)
        color_by = singular if is_plural else color_by
        title = color_by.replace("_", " ") if title is None else title
    values = [_values_of(cells, labels, color_by, len(series)) for labels in series]
    scale = scale_of(values, title or "")
    return [scale.colors(row) for row in values], scale


def _values_of(cells: Cells, labels: Any, color_by: Any, n_series: int) -> Floats:
    """Return one value per cell, (N,): NaN if the value is missing or the cell has no region."""
    if isinstance(color_by, str):
        columns = RegionGraph.column_names(kit.kind_of(cells).dimension)
        kit.checked_choice(color_by, "color_by", columns)
    if labels is None:
        if isinstance(color_by, str):
            raise ValueError(
                f"color_by={color_by!r} is the name of a region property: pass labels too"
            )
        return checked_values(color_by, "color_by", cells, None)[0]
    n_vertices = getattr(cells, "n_vertices", None)
    compact, ids = kit.compact_partial_labels(labels, cells.n_cells, n_vertices)
    if isinstance(color_by, str):
        table = region_graph(cells, compact).table()
        values = np.asarray(table[color_by], dtype=np.float64)
    else:
        n_regions = len(ids) if n_series == 1 else None
        values, of = checked_values(color_by, "color_by", cells, n_regions)
        if of == "cell":
            return np.where(compact < 0, np.nan, values)
    return np.append(values, np.nan)[compact]


@dataclass(frozen=True)
class _Panels:
    """Labelings that are drawn side by side."""

    cells: Cells
    series: Sequence[Any]  # labels of each panel, or None
    colors: Sequence[Any]  # for each panel, colors of the cells, or None for the default colors
    clip: Clip | None
    is_smooth: bool  # whether borders are smooth curves


def _draw_side_by_side(
    panels: _Panels, style: Style, n_frames: int, titles: Sequence[str] | None, scale: Scale | None
) -> tuple[list[Picture], Up]:
    """Return `n_frames` pictures of all panels side by side, and the axis that points up.

    Titles are above the panels, and the scale is below. No titles are drawn if `titles` is None,
    and no scale if `scale` is None.
    """
    width, height = style.frame
    count = len(panels.series)
    above, below = [], []
    if titles is not None:
        strip_height = round(TITLE_SHARE * height)
        above.append(title_strip(titles, width, strip_height, style.background))
        height -= strip_height
    if scale is not None:
        strip_height = round(SCALE_SHARE * style.frame[1])
        below.append(scale_strip(scale, width * count, strip_height, style.background))
        height -= strip_height
    inner = replace(style, frame=(width, height))
    columns, up = _drawn(panels, inner, n_frames)
    rows = [np.concatenate(row, axis=1) for row in zip(*columns, strict=True)]
    return [np.concatenate([*above, row, *below]) for row in rows], up


def _drawn(panels: _Panels, style: Style, n_frames: int) -> tuple[list[list[Picture]], Up]:
    columns, cameras, view = [], None, style.view
    for labels, colors in zip(panels.series, panels.colors, strict=True):
        scene = scene_of(panels.cells, labels, colors, panels.clip, is_smooth=panels.is_smooth)
        if cameras is None:
            view = upright(view, *surface_of(panels.cells))
            if n_frames == 1:
                cameras = [place_camera(scene.points, view, style.aspect)]
            else:
                cameras = orbiting_cameras(scene.points, view, style.aspect, n_frames)
        columns.append(draw_scene(scene, cameras, style))
    return columns, view.up
