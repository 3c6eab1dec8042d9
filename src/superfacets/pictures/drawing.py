"""A scene drawn by VTK, without a display."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .camera import Camera
from .gl import RenderError, quiet_vtk
from .needs import import_pillow, import_vtk
from .scene import Picture, Scene

__all__ = ["MAX_SIDE", "draw"]

MAX_SIDE = 8192
"""Longest side of a picture: twice this, for anti-aliasing, is what graphics drivers allow."""

# Each pixel is the mean of this many by this many: what smooths borders and outlines.
_SAMPLES = 2

# Edges sharper than this, in degrees, are shaded as edges: more than the facets of a coarse sphere
# make (500 faces: 14), less than the creases of a machine part.
_CREASE_ANGLE = 40.0

# How far border lines are drawn before the surface, in widths of the line: enough for the whole
# width to be seen on a surface that is tilted by 70 degrees (tan 70 / 2).
_LINE_LIFT = 1.4

# How far, as a fraction of the diagonal, the surface darkens what is near (ambient occlusion), and
# by how much of that a surface must stand out to count: concave creases get darker.
_SHADOW_REACH = 0.05
_SHADOW_BIAS = 0.06

# Points looked at per pixel for that: with half as many the noise can be seen.
_SHADOW_SAMPLES = 128

# Longest side, in pixels, at which soft shadows are drawn, but at least half of the picture's and
# at most that of its samples. They vary slowly and are magnified smoothly; at the size of the
# samples they take more time than all else.
_SHADOW_SIDE = 600

_LINE_COLOR = (28, 28, 32)

# Direction toward each light (right, up, toward the viewer) and its strength: a key light from the
# upper left, fills from the right, the eye and below. Together they just reach white.
_LIGHTS = (
    ((-0.5, 0.9, 1.0), 0.60),
    ((0.9, 0.2, 0.7), 0.22),
    ((0.0, 0.0, 1.0), 0.30),
    ((0.0, -1.0, 0.3), 0.15),
)


@dataclass(frozen=True)
class _Stage:
    """A window that is not shown, and what is in it."""

    window: Any
    renderer: Any
    surface: Any  # actor
    lines: Any  # actor; None without border lines


def draw(
    scene: Scene,
    camera: Camera,
    frame: tuple[int, int],
    line_width: float,
    background: tuple[int, int, int],
) -> Picture:
    """Return the picture, (height, width, 3), of a scene; the frame is (width, height).

    Colors and lines are drawn at twice the size and averaged; soft shadows are drawn smaller.
    """
    vtk = import_vtk()
    width, height = frame
    with quiet_vtk():
        stage = _set_stage(vtk, scene, camera, height, line_width)
        try:
            stage.renderer.SetBackground(*(channel / 255 for channel in background))
            samples = _shoot(vtk, stage, width * _SAMPLES, height * _SAMPLES)
            _leave_shadows_only(stage)
            shadows = _shoot(vtk, stage, *_shadow_frame(frame))
        finally:
            stage.window.Finalize()
    return _darkened(_averaged(samples), shadows)


def _set_stage(vtk: Any, scene: Scene, camera: Camera, height: int, line_width: float) -> _Stage:
    """Put surface, lines, lights and camera into a window."""
    window, renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    surface, lines = _surface(vtk, scene), None
    renderer.AddActor(surface)
    if line_width > 0 and len(scene.borders):
        lines = _border_lines(vtk, scene, camera, height, line_width)
        renderer.AddActor(lines)
    _light(vtk, renderer)
    _aim(renderer, camera)
    return _Stage(window, renderer, surface, lines)


def _surface(vtk: Any, scene: Scene) -> Any:
    """Actor of the faces, with normals that are shared but across creases."""
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(_poly_data(vtk, scene.points, faces=scene.triangles))
    normals.SplittingOn()
    normals.SetFeatureAngle(_CREASE_ANGLE)
    normals.ConsistencyOff()
    normals.NonManifoldTraversalOff()
    normals.Update()
    faces = normals.GetOutput()
    faces.GetCellData().SetScalars(vtk.numpy_to_vtk(scene.colors, deep=True))
    actor = _actor(vtk, faces)
    look = actor.GetProperty()
    look.SetInterpolationToPhong()
    look.SetAmbient(0.16)
    look.SetDiffuse(0.95)
    look.SetSpecular(0.08)
    look.SetSpecularPower(20.0)
    return actor


def _border_lines(vtk: Any, scene: Scene, camera: Camera, height: int, line_width: float) -> Any:
    """Actor of the lines, a little nearer to the camera so that the surface does not hide them.

    Moving a point along its line of sight changes its depth but not its place in the picture.
    """
    ends, borders = np.unique(scene.borders, return_inverse=True)
    sight = scene.points[ends] - camera.position
    pixel = 2 * camera.half_slope / height  # in units of the distance
    lifted = camera.position + sight * (1 - _LINE_LIFT * line_width * pixel)
    actor = _actor(vtk, _poly_data(vtk, lifted, lines=borders.reshape(-1, 2)))
    look = actor.GetProperty()
    look.SetColor(*(channel / 255 for channel in _LINE_COLOR))
    look.SetLineWidth(line_width * _SAMPLES)
    look.LightingOff()
    look.RenderLinesAsTubesOn()  # plain lines are thinner where they run diagonally
    return actor


def _poly_data(
    vtk: Any,
    points: npt.NDArray[np.float64],
    *,
    faces: npt.NDArray[np.int64] | None = None,
    lines: npt.NDArray[np.int64] | None = None,
) -> Any:
    """Points, and the faces, (F, 3), or lines, (B, 2), between them."""
    data, places = vtk.vtkPolyData(), vtk.vtkPoints()
    places.SetData(vtk.numpy_to_vtk(points.astype(np.float32), deep=True))
    data.SetPoints(places)
    for corners, put in ((faces, data.SetPolys), (lines, data.SetLines)):
        if corners is not None:
            cells = vtk.vtkCellArray()
            flat = corners.astype(np.int32).ravel()
            cells.SetData(corners.shape[1], vtk.numpy_to_vtk(flat, deep=True))
            put(cells)
    return data


def _actor(vtk: Any, data: Any) -> Any:
    """Actor of the data, with the colors of its faces."""
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputData(data)
    mapper.SetScalarModeToUseCellData()
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    return actor


def _light(vtk: Any, renderer: Any) -> None:
    """Add the lights, which move with the camera."""
    renderer.AutomaticLightCreationOff()
    for direction, strength in _LIGHTS:
        light = vtk.vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*direction)
        light.SetFocalPoint(0, 0, 0)
        light.SetIntensity(strength)
        light.PositionalOff()
        renderer.AddLight(light)


def _aim(renderer: Any, camera: Camera) -> None:
    """Set the camera."""
    eye = renderer.GetActiveCamera()
    eye.SetPosition(*camera.position)
    eye.SetFocalPoint(*camera.target)
    eye.SetViewUp(*camera.up)
    eye.SetViewAngle(2 * math.degrees(math.atan(camera.half_slope)))
    renderer.ResetCameraClippingRange()


def _leave_shadows_only(stage: _Stage) -> None:
    """Make everything white except the shadows in creases."""
    stage.renderer.SetBackground(1, 1, 1)
    stage.surface.GetMapper().ScalarVisibilityOff()
    look = stage.surface.GetProperty()
    look.SetColor(1, 1, 1)
    look.SetAmbient(1)
    look.SetDiffuse(0)
    look.SetSpecular(0)
    if stage.lines is not None:
        stage.lines.VisibilityOff()
    stage.renderer.SetUseSSAO(True)
    stage.renderer.SetSSAORadius(_SHADOW_REACH)
    stage.renderer.SetSSAOBias(_SHADOW_BIAS * _SHADOW_REACH)
    stage.renderer.SetSSAOKernelSize(_SHADOW_SAMPLES)
    stage.renderer.SSAOBlurOn()


def _shadow_frame(frame: tuple[int, int]) -> tuple[int, int]:
    """Width and height at which soft shadows are drawn."""
    scale = min(max(_SHADOW_SIDE / max(frame), 0.5), _SAMPLES)
    width, height = (math.ceil(scale * side) for side in frame)
    return width, height


def _shoot(vtk: Any, stage: _Stage, width: int, height: int) -> Picture:
    """Pixels of the window, (height, width, 3), row 0 at the top."""
    stage.window.SetSize(width, height)
    stage.window.Render()
    pixels = vtk.vtkUnsignedCharArray()
    stage.window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
    flat = vtk.vtk_to_numpy(pixels)
    if flat.size != height * width * 3:
        raise RenderError(f"the driver made {flat.size} samples, not {height * width * 3}")
    return np.asarray(flat.reshape(height, width, 3)[::-1], dtype=np.uint8)


def _averaged(samples: Picture) -> Picture:
    """Means of blocks of samples, in integers: a third of the time of floating point."""
    sums = np.zeros((len(samples) // _SAMPLES, samples.shape[1] // _SAMPLES, 3), dtype=np.uint16)
    for row, column in np.ndindex(_SAMPLES, _SAMPLES):
        sums += samples[row::_SAMPLES, column::_SAMPLES]
    n_samples = _SAMPLES * _SAMPLES
    return ((sums + n_samples // 2) // n_samples).astype(np.uint8)


def _darkened(picture: Picture, shadows: Picture) -> Picture:
    """Picture times the shadows, gray and of another size; 255 for none."""
    image = import_pillow("Image")
    gray = image.fromarray(np.ascontiguousarray(shadows[..., 0]))
    fitting = gray.resize(picture.shape[1::-1], image.Resampling.BILINEAR)
    factors = np.asarray(fitting, dtype=np.uint16)[..., np.newaxis]
    return ((picture * factors + 127) // 255).astype(np.uint8)
