"""Draw scenes with VTK, without a display."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from superfacets import RenderError
from superfacets.kit import Floats, Ints, Longs, ranked_labels

from .annotations import draw_numbers
from .backend import import_pillow, import_vtk, quiet_vtk
from .camera import Camera
from .scene import Picture, Scene

MAX_SIDE = 8192
"""Maximum width and height of a picture in pixels. Pictures are drawn at twice their size, and
graphics drivers support up to 16,384 pixels."""

# Number of samples per pixel in each direction. Samples are averaged for antialiasing.
_SAMPLES = 2

# Angle between two faces, in degrees, above which their common edge is shaded as sharp. The limit
# is above the angles of a coarse sphere (14 degrees with 500 faces), and below the angles at
# creases of machine parts.
_CREASE_ANGLE = 40.0

# Distance of border lines in front of the surface, in line widths: about tan(70 degrees) / 2, so
# that lines are completely visible on surfaces tilted by up to 70 degrees.
_LINE_LIFT = 1.4

# Parameters of ambient occlusion, which darkens concave creases: radius as a fraction of the
# diagonal, and minimum depth of an occluded surface as a fraction of the radius.
_SHADOW_REACH = 0.05
_SHADOW_BIAS = 0.06

# Number of samples per pixel for ambient occlusion; a blur removes the remaining noise.
_SHADOW_SAMPLES = 64

# Longest side, in pixels, of the image of ambient occlusion. It is changed to at least 0.4 and at
# most 2 times the longest side of the picture. Ambient occlusion varies slowly over the picture, so
# drawing a small image and magnifying it saves time.
_SHADOW_SIDE = 480

_LINE_COLOR = (28, 28, 32)

# Direction (right, up, toward the viewer) and intensity of each light: a key light from the upper
# left, and fill lights from the right, from the viewer and from below. No surface is overexposed.
_LIGHTS = (
    ((-0.5, 0.9, 1.0), 0.60),
    ((0.9, 0.2, 0.7), 0.22),
    ((0.0, 0.0, 1.0), 0.30),
    ((0.0, -1.0, 0.3), 0.15),
)


@dataclass(frozen=True)
class _Stage:
    """An off-screen VTK window and its contents."""

    window: Any
    renderer: Any
    surface: Any  # VTK actor of the faces
    lines: _Lines | None  # border lines, or None if no lines are drawn


@dataclass(frozen=True)
class _Lines:
    """Border lines. For each camera, they are moved to positions in front of the surface."""

    actor: Any  # VTK actor of the lines
    data: Any  # vtkPolyData: visible lines, with their ends after the move
    ends: Floats  # (P, 3) ends of the lines on the surface, before the move
    lines: Longs  # (B, 2) indices into `ends`, for each border of the scene
    lift: float  # move toward the camera, as a fraction of the distance from the camera


def draw(
    scene: Scene, cameras: Sequence[Camera], frame: tuple[int, int], line_width: float,
    background: tuple[int, int, int], *, has_numbers: bool = False, hides_backs: bool = False,
) -> list[Picture]:  # fmt: skip
    """Return a picture of the scene for each camera, (height, width, 3).

    `frame` is (width, height), and `line_width` is the width of borders in pixels; with 0, no
    borders are drawn. All cameras must have the same field of view. If `has_numbers` is True, the
    label of each visible region is written on it. If `hides_backs` is True, triangles seen from
    behind are hidden, and so are borders between two such triangles.
    """
    vtk = import_vtk()
    width, height = frame
    pictures = []
    with quiet_vtk():
        stage = _set_stage(vtk, scene, cameras[0].half_slope, height, line_width)
        stage.surface.GetProperty().SetBackfaceCulling(hides_backs)
        try:
            for camera in cameras:
                _aim(vtk, stage, camera)
                if hides_backs and stage.lines is not None:
                    in_front = scene.are_borders_in_front(camera.position)
                    lines = stage.lines.lines[in_front]
                    stage.lines.data.SetLines(_cell_array(vtk, lines))
                _show(stage, background, shadows=False)
                samples = _shoot(vtk, stage, width * _SAMPLES, height * _SAMPLES)
                _show(stage, (255, 255, 255), shadows=True)
                shadows = _shoot(vtk, stage, *_shadow_frame(frame))
                picture = _combined(samples, shadows, background)
                if has_numbers and scene.labels is not None:
                    ranks, ids = ranked_labels(scene.labels)
                    regions = _shoot_regions(vtk, stage, scene.colors, ranks, frame)
                    picture = draw_numbers(picture, regions, ids)
                pictures.append(picture)
        finally:
            stage.window.Finalize()
    return pictures


def _set_stage(vtk: Any, scene: Scene, half_slope: float, height: int, line_width: float) -> _Stage:
    window, renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    surface, lines = _surface(vtk, scene), None
    renderer.AddActor(surface)
    if line_width > 0 and len(scene.borders):
        pixel = 2 * half_slope / height  # height of a pixel at distance 1
        lines = _border_lines(vtk, scene, line_width, _LINE_LIFT * line_width * pixel)
        renderer.AddActor(lines.actor)
    _light(vtk, renderer)
    renderer.SetSSAORadius(_SHADOW_REACH)
    renderer.SetSSAOBias(_SHADOW_BIAS * _SHADOW_REACH)
    renderer.SetSSAOKernelSize(_SHADOW_SAMPLES)
    renderer.SSAOBlurOn()
    return _Stage(window, renderer, surface, lines)


def _surface(vtk: Any, scene: Scene) -> Any:
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
    look.SetColor(1, 1, 1)  # for the image of ambient occlusion, which does not use face colors
    look.SetSpecularPower(20.0)
    return actor


def _border_lines(vtk: Any, scene: Scene, line_width: float, lift: float) -> _Lines:
    ends, indices = np.unique(scene.borders, return_inverse=True)
    lines = indices.reshape(-1, 2)
    data = _poly_data(vtk, scene.points[ends], lines=lines)
    actor = _actor(vtk, data)
    look = actor.GetProperty()
    look.SetColor(*(channel / 255 for channel in _LINE_COLOR))
    look.SetLineWidth(line_width * _SAMPLES)
    look.LightingOff()
    look.RenderLinesAsTubesOn()  # plain lines are thinner along diagonals
    return _Lines(actor, data, scene.points[ends], lines, lift)


def _poly_data(
    vtk: Any, points: Floats, *, faces: Longs | None = None, lines: Longs | None = None
) -> Any:
    """Create a vtkPolyData with points, (P, 3), and with faces, (F, 3), or lines, (B, 2)."""
    data, places = vtk.vtkPolyData(), vtk.vtkPoints()
    places.SetData(vtk.numpy_to_vtk(points.astype(np.float32), deep=True))
    data.SetPoints(places)
    for corners, put in ((faces, data.SetPolys), (lines, data.SetLines)):
        if corners is not None:
            put(_cell_array(vtk, corners))
    return data


def _cell_array(vtk: Any, corners: Longs) -> Any:
    """Create a vtkCellArray of cells with the given indices of points, (N, corners per cell)."""
    cells = vtk.vtkCellArray()
    flat = corners.astype(np.int32).ravel()
    cells.SetData(corners.shape[1], vtk.numpy_to_vtk(flat, deep=True))
    return cells


def _actor(vtk: Any, data: Any) -> Any:
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputData(data)
    mapper.SetScalarModeToUseCellData()
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    return actor


def _light(vtk: Any, renderer: Any) -> None:
    """Add the lights of `_LIGHTS`, which move with the camera."""
    renderer.AutomaticLightCreationOff()
    for direction, strength in _LIGHTS:
        light = vtk.vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*direction)
        light.SetFocalPoint(0, 0, 0)
        light.SetIntensity(strength)
        light.PositionalOff()
        renderer.AddLight(light)


def _aim(vtk: Any, stage: _Stage, camera: Camera) -> None:
    """Set the camera, and move border lines toward it, so that the surface does not hide lines."""
    if stage.lines is not None:
        ends = stage.lines.ends
        lifted = ends + stage.lines.lift * (camera.position - ends)
        places = stage.lines.data.GetPoints()
        places.SetData(vtk.numpy_to_vtk(lifted.astype(np.float32), deep=True))
    eye = stage.renderer.GetActiveCamera()
    eye.SetPosition(*camera.position)
    eye.SetFocalPoint(*camera.target)
    eye.SetViewUp(*camera.up)
    eye.SetViewAngle(2 * math.degrees(math.atan(camera.half_slope)))
    stage.renderer.ResetCameraClippingRange()


def _show(stage: _Stage, background: tuple[int, int, int], *, shadows: bool) -> None:
    """Prepare the next image, which shows the scene with lights and colors.

    If `shadows` is True, the next image shows ambient occlusion on a white surface instead.
    """
    stage.renderer.SetBackground(*(channel / 255 for channel in background))
    stage.renderer.SetUseSSAO(shadows)
    stage.surface.GetMapper().SetScalarVisibility(not shadows)
    look = stage.surface.GetProperty()
    look.SetAmbient(1.0 if shadows else 0.16)
    look.SetDiffuse(0.0 if shadows else 0.95)
    look.SetSpecular(0.0 if shadows else 0.08)
    if stage.lines is not None:
        stage.lines.actor.SetVisibility(not shadows)


def _shadow_frame(frame: tuple[int, int]) -> tuple[int, int]:
    scale = min(max(_SHADOW_SIDE / max(frame), 0.4), _SAMPLES)
    width, height = (math.ceil(scale * side) for side in frame)
    return width, height


def _shoot(vtk: Any, stage: _Stage, width: int, height: int) -> Picture:
    """Render the window in the given size; return its pixels, (height, width, 3), top row first."""
    stage.window.SetSize(width, height)
    stage.window.Render()
    pixels = vtk.vtkUnsignedCharArray()
    stage.window.GetPixelData(0, 0, width - 1, height - 1, 0, pixels, 0)
    flat = vtk.vtk_to_numpy(pixels)
    if flat.size != height * width * 3:
        raise RenderError(f"VTK returned {flat.size} values instead of {height * width * 3}")
    return np.asarray(flat.reshape(height, width, 3)[::-1], dtype=np.uint8)


def _shoot_regions(
    vtk: Any, stage: _Stage, colors: Picture, regions: Ints, frame: tuple[int, int]
) -> Ints:
    """Return the region visible in each pixel, (height, width), or -1 for no region.

    `regions` contains the region of each triangle, or -1. The surface is drawn without light, and
    the color of a region is its index + 1 in base 256. Afterwards, triangles have their `colors`
    again. Border lines must be hidden, as in the image of ambient occlusion.
    """
    codes = ((regions[:, np.newaxis] + 1) >> np.array([0, 8, 16])).astype(np.uint8)
    faces, look = stage.surface.GetMapper().GetInput(), stage.surface.GetProperty()
    stage.renderer.SetBackground(0, 0, 0)
    stage.renderer.SetUseSSAO(False)
    stage.surface.GetMapper().SetScalarVisibility(True)
    look.LightingOff()
    faces.GetCellData().SetScalars(vtk.numpy_to_vtk(codes, deep=True))
    pixels = _shoot(vtk, stage, *frame).astype(np.int32)
    faces.GetCellData().SetScalars(vtk.numpy_to_vtk(colors, deep=True))
    look.LightingOn()
    return pixels @ np.array([1, 256, 65536], dtype=np.int32) - 1


def _combined(samples: Picture, shadows: Picture, background: tuple[int, int, int]) -> Picture:
    """Average the samples of each pixel, and multiply the result by the image of ambient occlusion.

    The image of ambient occlusion, `shadows`, is magnified to the size of the picture.
    """
    image, chops, blurs = (import_pillow(name) for name in ("Image", "ImageChops", "ImageFilter"))
    lit = image.fromarray(np.ascontiguousarray(samples)).reduce(_SAMPLES)
    gray = image.fromarray(np.ascontiguousarray(shadows[..., 0])).filter(blurs.BoxBlur(1))
    factors = np.array(gray.resize(lit.size, image.Resampling.BILINEAR))
    # Background pixels are not darkened. To save time, the four bytes of a pixel are compared as
    # one integer.
    bare = np.frombuffer(bytes((*background, 255)), np.uint32)
    packed = np.frombuffer(lit.convert("RGBA").tobytes(), np.uint32)
    factors.ravel()[packed == bare] = 255
    shade = image.fromarray(factors)
    return np.asarray(chops.multiply(lit, image.merge("RGB", [shade] * 3)))
