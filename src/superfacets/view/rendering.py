"""Stage 7: pictures of meshes and their regions, made without a display."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import (
    checked_choice,
    checked_count,
    checked_number,
    checked_threads,
    compact_labels,
    refuse_mask,
)
from ..adapters.convert import MeshLike, as_mesh
from ..cells.face_graph import FaceGraph, build_face_graph
from ..errors import MissingExtraError
from ..io.atomic import atomic_outputs, checked_targets
from ..mesh.triangle_mesh import Mesh
from .colors import region_colors
from .gl import RenderError, ensure_gl, quiet_vtk

__all__ = ["View", "check_rendering", "render"]

FloatArray = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]

MAX_SIDE = 8192
"""Longest side of a picture: twice this, for anti-aliasing, is what graphics drivers allow."""

# Each pixel is the mean of this many by this many: what smooths borders and outlines.
_SAMPLES = 2

# Half of the angle that the picture's height spans, degrees: a long lens, little distortion.
_HALF_VIEW_ANGLE = 10.0

# Share of the height or width left free, so that outlines are not cut by the frame.
_MARGIN = 0.03

# Edges sharper than this, in degrees, are shaded as edges: more than the facets of a coarse sphere
# make (500 faces: 14), less than the creases of a machine part.
_CREASE_ANGLE = 40.0

# How far border lines are drawn before the surface, in widths of the line: enough for the whole
# width to be seen on a surface that is tilted by 70 degrees (tan 70 / 2).
_LINE_LIFT = 1.4

# How far, as a fraction of the diagonal, the surface darkens what is near (ambient occlusion):
# concave creases stand out.
_SHADOW_REACH = 0.05

_PLAIN_COLOR = (205, 197, 184)
_LINE_COLOR = (28, 28, 32)

# Direction toward each light (right, up, toward the viewer) and its strength: a key light from the
# upper left, fills from the right, the eye and below. Together they just reach white.
_LIGHTS = (
    ((-0.5, 0.9, 1.0), 0.60),
    ((0.9, 0.2, 0.7), 0.22),
    ((0.0, 0.0, 1.0), 0.30),
    ((0.0, -1.0, 0.3), 0.15),
)

# For each axis that may point up: the directions right and toward the viewer at azimuth 0.
_FRAMES = {
    "x": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "y": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
}


@dataclass(frozen=True, kw_only=True)
class View:
    """Where a picture is taken from. The whole mesh fills the frame at zoom 1.

    Parameters
    ----------
    azimuth : float, default 30.0
        Degrees that the viewer walks around the mesh, to the viewer's right, from its front.
    elevation : float, default 15.0
        Degrees above the horizon, -90 (from below) to 90 (from above).
    up : {"y", "x", "z"}
        Axis that points up. The front is +z, but -y where z points up.
    zoom : float, default 1.0
        Magnification about the middle of the picture, > 0.

    Raises
    ------
    ValueError, TypeError
        If a value is out of range or not a number.
    """

    azimuth: float = 30.0
    elevation: float = 15.0
    up: str = "y"
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.azimuth):
            raise ValueError(f"azimuth must be finite, got {self.azimuth}")
        if not -90 <= self.elevation <= 90:
            raise ValueError(f"elevation must be -90 to 90 degrees, got {self.elevation}")
        checked_choice(self.up, "up", tuple(_FRAMES))
        checked_number(self.zoom, "zoom", zero=False)


def render(
    mesh: MeshLike,
    labels: npt.ArrayLike | None = None,
    *,
    output: str | os.PathLike[str] | None = None,
    colors: npt.ArrayLike | None = None,
    size: tuple[int, int] = (1200, 900),
    view: View | None = None,
    border_width: float | None = None,
    background: str = "white",
) -> Picture:
    """Return a shaded picture of a mesh, its regions colored and outlined.

    No display is needed: on Linux, Mesa's EGL or OSMesa will do. Shading is smooth, but for creases
    of more than 40 degrees. Borders between regions are drawn where faces of two labels share an
    edge; vertices at exactly the same position count as one. A file is complete or not there: an
    existing one is replaced at the very end. Time is linear in faces and in pixels.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    labels : array_like of integers, shape (F,), optional
        Region of each face, any numbers. Without labels the mesh is plain.
    output : path, optional
        Where to write the picture, as PNG.
    colors : array_like of uint8, shape (F, 3), optional
        Color of each face, sRGB; by default `face_colors`.
    size : (int, int), default (1200, 900)
        Width and height in pixels, at most 8192 each.
    view : View, optional
        Where the picture is taken from; by default from the right and a little above, y up.
    border_width : float, optional
        Pixels; 0 draws no borders. By default a 450th of the picture's height (but 1 at least) for
        up to 400 regions, falling with the size of regions to two fifths of that.
    background : str, default "white"
        Name or "#rrggbb" of a color.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Red, green and blue, sRGB; row 0 is at the top.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If another argument is not as described.
    MissingExtraError
        If PyVista is not installed.
    RenderError
        If there is no OpenGL on this machine; the message says what to install.
    OSError
        If the file cannot be written.
    """
    checked_mesh = as_mesh(mesh)
    frame = (_checked_side(size, 0), _checked_side(size, 1))
    path = None if output is None else _checked_path(output)
    pyvista = _import_pyvista()
    backdrop = _checked_background(pyvista, background)
    scene = _build_scene(checked_mesh, labels, colors)
    view = _checked_view(view)
    camera = _place_camera(scene.points, view, frame[0] / frame[1])
    width = _line_width(border_width, frame[1], scene.n_regions, view.zoom)
    picture = _draw(pyvista, scene, camera, frame, width, backdrop)
    if path is not None:
        _write_png(picture, path)
    return picture


def check_rendering() -> None:
    """Raise what `render` would raise here for want of PyVista or OpenGL."""
    _import_pyvista()
    ensure_gl()


@dataclass(frozen=True)
class _Scene:
    """What is drawn, scaled and moved to a box of diagonal 1 around the origin."""

    points: FloatArray  # (P, 3), no two at one place, all used
    triangles: npt.NDArray[np.int64]  # (F, 3)
    colors: Picture  # (F, 3)
    borders: npt.NDArray[np.int64]  # (B, 2), ends of edges between regions
    n_regions: int  # 1 without labels


@dataclass(frozen=True)
class _Camera:
    """A perspective camera."""

    position: FloatArray
    target: FloatArray
    up: FloatArray
    half_slope: float  # half of the height seen, per distance


def _checked_view(view: View | None) -> View:
    if view is not None and not isinstance(view, View):
        raise TypeError(f"view must be a superfacets.View, got {view!r}")
    return view or View()


def _checked_side(size: tuple[int, int], side: int) -> int:
    """Width (side 0) or height (side 1) in pixels."""
    if not isinstance(size, (tuple, list)) or len(size) != 2:
        raise ValueError(f"size must be (width, height), got {size!r}")
    count = checked_count(size[side], "size")
    if count > MAX_SIDE:
        raise ValueError(f"size must be at most {MAX_SIDE} pixels a side, got {count}")
    return count


def _checked_path(output: str | os.PathLike[str]) -> Path:
    """Path of a PNG in a folder that exists: better known before the picture is made than after."""
    path = Path(output)
    if path.suffix.lower() != ".png":
        raise ValueError(f"output must end in .png, got {path.name!r}")
    checked_targets([path])
    return path


def _checked_background(pyvista: Any, background: str) -> tuple[int, int, int]:
    """Red, green and blue of a color given by name or as "#rrggbb"."""
    try:
        red, green, blue = pyvista.Color(background).int_rgb
    except (ValueError, TypeError):
        raise ValueError(
            f'background must be the name of a color or "#rrggbb", got {background!r}'
        ) from None
    return red, green, blue


def _checked_colors(colors: npt.ArrayLike, n_faces: int) -> Picture:
    """Colors of faces as an (F, 3) uint8 array."""
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    if array.shape != (n_faces, 3):
        raise ValueError(f"colors must have shape ({n_faces}, 3), got {array.shape}")
    if array.dtype != np.uint8:
        raise TypeError(f"colors must be uint8, 0 to 255, got {array.dtype}")
    return np.ascontiguousarray(array)


def _build_scene(mesh: Mesh, labels: npt.ArrayLike | None, colors: npt.ArrayLike | None) -> _Scene:
    """Weld, drop unused vertices, scale to unit size, color and find the borders."""
    corners = _core.weld_vertices(mesh.vertices, checked_threads(None))[mesh.faces]
    used = np.zeros(mesh.n_vertices, dtype=bool)
    used[corners] = True
    triangles = (np.cumsum(used) - 1)[corners]
    points = mesh.vertices[used]
    low, high = points.min(axis=0), points.max(axis=0)
    points = (points - (low + high) / 2) / np.linalg.norm(high - low)
    face_colors = np.tile(np.array(_PLAIN_COLOR, dtype=np.uint8), (mesh.n_faces, 1))
    borders, n_regions = np.empty((0, 2), dtype=np.int64), 1
    if labels is not None:
        checked, n_regions = compact_labels(labels, mesh.n_faces)
        graph = build_face_graph(mesh)
        face_colors = region_colors(graph, checked)[checked]
        borders = _border_edges(graph, triangles, checked)
    if colors is not None:
        face_colors = _checked_colors(colors, mesh.n_faces)
    return _Scene(points, triangles, face_colors, borders, n_regions)


def _border_edges(
    graph: FaceGraph, triangles: npt.NDArray[np.int64], labels: npt.NDArray[np.int32]
) -> npt.NDArray[np.int64]:
    """Ends, (B, 2), of the edges between faces of different labels, each pair of faces once."""
    sources = np.repeat(np.arange(len(triangles), dtype=np.int32), np.diff(graph.offsets))
    between = (labels[sources] != labels[graph.neighbors]) & (sources < graph.neighbors)
    faces, sides = sources[between], graph.sides[between]
    return np.stack([triangles[faces, sides], triangles[faces, (sides + 1) % 3]], axis=1)


def _place_camera(points: FloatArray, view: View, aspect: float) -> _Camera:
    """Camera from which the points just fill the frame."""
    right, toward, up = _view_axes(view)
    across, height, depth = points @ right, points @ up, points @ toward
    across_middle, height_middle, depth_middle = map(_midrange, (across, height, depth))
    slope = math.tan(math.radians(_HALF_VIEW_ANGLE))
    distance = 0.0
    # In perspective the middle of the box is not that of the picture, but the error falls more
    # than fivefold each turn.
    for _ in range(4):
        x, y, z = across - across_middle, height - height_middle, depth - depth_middle
        reach = np.maximum(np.abs(y), np.abs(x) / aspect) / (slope * (1 - _MARGIN))
        distance = float((z + reach).max())
        across_middle += distance * _midrange(x / (distance - z))
        height_middle += distance * _midrange(y / (distance - z))
    target = across_middle * right + height_middle * up + depth_middle * toward
    return _Camera(target + distance * toward, target, up, slope / view.zoom)


def _midrange(values: FloatArray) -> float:
    """Mean of the least and the largest value."""
    return float(values.min() + values.max()) / 2


def _view_axes(view: View) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors to the right, toward the viewer and up, as the viewer sees them."""
    right, front = (np.array(axis) for axis in _FRAMES[view.up])
    azimuth, elevation = math.radians(view.azimuth), math.radians(view.elevation)
    outward = math.cos(azimuth) * front + math.sin(azimuth) * right
    right = math.cos(azimuth) * right - math.sin(azimuth) * front
    pole = np.cross(outward, right)
    toward = math.cos(elevation) * outward + math.sin(elevation) * pole
    return right, toward, np.cross(toward, right)


def _line_width(wanted: float | None, height: int, n_regions: int, zoom: float) -> float:
    """Width of borders in pixels: thinner where regions are small."""
    if wanted is not None:
        return checked_number(wanted, "border_width", zero=True)
    return max(1.0, height / 450) * min(1.0, max(0.4, zoom * math.sqrt(400 / n_regions)))


def _import_pyvista() -> Any:
    """Return the module. Importing it does not touch OpenGL yet."""
    try:
        import pyvista
    except ModuleNotFoundError:
        raise MissingExtraError("rendering", "viz") from None
    except ImportError as error:
        raise RenderError(f"PyVista cannot be loaded: {error}") from error
    return pyvista


def _draw(
    pyvista: Any,
    scene: _Scene,
    camera: _Camera,
    frame: tuple[int, int],
    line_width: float,
    background: tuple[int, int, int],
) -> Picture:
    """Draw at twice the size, and average."""
    width, height = frame[0] * _SAMPLES, frame[1] * _SAMPLES
    with quiet_vtk():
        plotter = pyvista.Plotter(
            off_screen=True,
            window_size=(width, height),
            lighting="none",
            theme=pyvista.themes.DocumentTheme(),  # not the user's, so that pictures are alike
        )
        try:
            plotter.set_background(background)
            _add_surface(pyvista, plotter, scene)
            if line_width > 0 and len(scene.borders):
                _add_borders(pyvista, plotter, scene, camera, line_width * _SAMPLES)
            _aim(pyvista, plotter, camera)
            samples = plotter.screenshot(return_img=True)
        finally:
            plotter.close()
    if samples.shape != (height, width, 3):
        raise RenderError(f"the driver made {samples.shape} samples, not {(height, width, 3)}")
    blocks = samples.reshape(frame[1], _SAMPLES, frame[0], _SAMPLES, 3)
    return np.asarray(blocks.mean(axis=(1, 3)).round(), dtype=np.uint8)


def _add_surface(pyvista: Any, plotter: Any, scene: _Scene) -> None:
    """Add the faces, with normals that are shared but across creases."""
    surface = pyvista.PolyData.from_regular_faces(
        scene.points.astype(np.float32), scene.triangles
    ).compute_normals(
        cell_normals=False,
        split_vertices=True,
        feature_angle=_CREASE_ANGLE,
        consistent_normals=False,
        non_manifold_traversal=False,
    )
    surface.cell_data["color"] = scene.colors
    actor = plotter.add_mesh(
        surface, scalars="color", preference="cell", rgb=True, show_scalar_bar=False
    )
    actor.prop.interpolation = "Phong"
    actor.prop.ambient, actor.prop.diffuse = 0.16, 0.95
    actor.prop.specular, actor.prop.specular_power = 0.08, 20.0


def _add_borders(
    pyvista: Any, plotter: Any, scene: _Scene, camera: _Camera, line_width: float
) -> None:
    """Add the border lines, a little nearer to the camera so that the surface does not hide them.

    Moving a point along its line of sight changes its depth but not its place in the picture.
    """
    ends, borders = np.unique(scene.borders, return_inverse=True)
    sight = scene.points[ends] - camera.position
    pixel = 2 * camera.half_slope / plotter.window_size[1]  # in units of the distance
    lifted = camera.position + sight * (1 - _LINE_LIFT * line_width * pixel)
    borders = borders.reshape(-1, 2)
    cells = np.column_stack([np.full(len(borders), 2), borders])
    lines = pyvista.PolyData(lifted.astype(np.float32), lines=cells.ravel())
    plotter.add_mesh(
        lines,
        color=_LINE_COLOR,
        line_width=line_width,
        lighting=False,
        render_lines_as_tubes=True,  # plain lines are thinner where they run diagonally
    )


def _aim(pyvista: Any, plotter: Any, camera: _Camera) -> None:
    """Set the camera, the lights that move with it, and soft shadows in creases."""
    plotter.camera.position = camera.position
    plotter.camera.focal_point = camera.target
    plotter.camera.up = camera.up
    plotter.camera.view_angle = 2 * math.degrees(math.atan(camera.half_slope))
    plotter.reset_camera_clipping_range()
    plotter.enable_ssao(radius=_SHADOW_REACH, bias=0.06 * _SHADOW_REACH, kernel_size=64, blur=True)
    for direction, strength in _LIGHTS:
        light = pyvista.Light(position=direction, light_type="camera light", intensity=strength)
        light.positional = False
        plotter.add_light(light)


def _write_png(picture: Picture, path: Path) -> None:
    from PIL import Image  # comes with PyVista

    with atomic_outputs([path]) as (partial,):
        Image.fromarray(picture).save(partial, format="PNG")
