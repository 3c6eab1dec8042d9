"""Read cameras and poses of a COLMAP model, in text or binary format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError
from superfacets.kit import BinaryReader, Floats, named_errors, read_content, rotation_of


class _Model(NamedTuple):
    number: int  # identifier of the camera model in binary files
    n_focal: int  # number of focal lengths, which precede the principal point
    n_distortion: int  # number of distortion coefficients, which follow the principal point
    is_central: bool = True  # whether the model is a pinhole camera if all coefficients are 0


_MODELS = {
    "SIMPLE_PINHOLE": _Model(0, 1, 0),
    "PINHOLE": _Model(1, 2, 0),
    "SIMPLE_RADIAL": _Model(2, 1, 1),
    "RADIAL": _Model(3, 1, 2),
    "OPENCV": _Model(4, 2, 4),
    "OPENCV_FISHEYE": _Model(5, 2, 4, False),
    "FULL_OPENCV": _Model(6, 2, 8),
    "FOV": _Model(7, 2, 1, False),
    "SIMPLE_RADIAL_FISHEYE": _Model(8, 1, 1, False),
    "RADIAL_FISHEYE": _Model(9, 1, 2, False),
    "THIN_PRISM_FISHEYE": _Model(10, 2, 8, False),
    "RAD_TAN_THIN_PRISM_FISHEYE": _Model(11, 2, 12, False),
}
_NAMES = {model.number: name for name, model in _MODELS.items()}

UNDISTORT = (
    "only pinhole cameras are supported (PINHOLE, SIMPLE_PINHOLE, and models whose distortion is"
    " 0): undistort images and masks first, for example with colmap image_undistorter"
)


class PosedImage(NamedTuple):
    """An image and the arguments of its `PinholeCamera`."""

    name: str
    pose: Any
    intrinsics: Any
    size: Any
    is_opengl: bool = False  # whether the axes of the camera are as in OpenGL


def is_colmap(folder: Path) -> bool:
    """Return whether a folder contains a COLMAP model."""
    return _ending_of(folder) is not None


def read_colmap(folder: Path) -> list[PosedImage]:
    """Return the images of a COLMAP model; binary files are preferred to text files."""
    ending = _ending_of(folder) or ".bin"
    of_cameras, of_images = (folder / f"{name}{ending}" for name in ("cameras", "images"))
    with named_errors(of_cameras):
        cameras = dict(_CAMERAS[ending](_content(of_cameras)))
    with named_errors(of_images):
        return [
            PosedImage(name, _pose_of(numbers), *_camera_of(cameras, camera, name))
            for name, camera, numbers in _IMAGES[ending](_content(of_images))
        ]


def _ending_of(folder: Path) -> str | None:
    for ending in (".bin", ".txt"):
        if (folder / f"images{ending}").is_file() and (folder / f"cameras{ending}").is_file():
            return ending
    return None


def _content(path: Path) -> bytes:
    return bytes(read_content(path))


_Camera = tuple[Floats, tuple[int, int]]
"""Intrinsics (fx, fy, cx, cy) and size (width, height)."""

_Image = tuple[str, int, list[float]]
"""Name, camera number, and pose from world to camera: quaternion (w, x, y, z) and translation."""


def _camera_of(cameras: dict[int, _Camera], number: int, image: str) -> _Camera:
    if number not in cameras:
        raise MeshError(f"image {image} refers to camera {number}, which does not exist")
    return cameras[number]


def _intrinsics_of(camera: int, model: str, params: list[float]) -> Floats:
    """Return fx, fy, cx, cy, or raise a MeshError if the camera is not a pinhole camera."""
    known = _MODELS.get(model)
    if known is None or not known.is_central:
        raise MeshError(f"camera {camera} has the model {model}: {UNDISTORT}")
    if len(params) != known.n_focal + 2 + known.n_distortion:
        raise MeshError(
            f"camera {camera}, {model}, must have {known.n_focal + 2 + known.n_distortion}"
            f" parameters, got {len(params)}"
        )
    if any(params[known.n_focal + 2 :]):
        raise MeshError(f"camera {camera}, {model}, has distortion: {UNDISTORT}")
    focal, center = params[: known.n_focal], params[known.n_focal : known.n_focal + 2]
    return np.array([focal[0], focal[-1], *center])


def _pose_of(numbers: list[float]) -> Floats:
    """Return the matrix from camera to world, (4, 4)."""
    pose, to_camera = np.eye(4), rotation_of(numbers[:4])
    if to_camera is None or not np.isfinite(numbers).all():
        raise MeshError(f"a pose must be finite, with a quaternion other than 0, got {numbers}")
    pose[:3, :3] = to_camera.T
    with np.errstate(over="ignore"):  # `PinholeCamera` refuses infinite poses
        pose[:3, 3] = -(to_camera * np.array(numbers[4:])[:, np.newaxis]).sum(axis=0)
    return pose


def _lines_of(data: bytes) -> Iterator[tuple[int, str]]:
    """Yield the number and the text of each line that is not a comment; lines may be empty."""
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        if not line.startswith("#"):
            yield number, line.strip()


def _cameras_in_text(data: bytes) -> Iterator[tuple[int, _Camera]]:
    for number, line in _lines_of(data):
        words = line.split()
        if not words:
            continue
        try:
            camera, size = int(words[0]), (int(words[2]), int(words[3]))
            params = [float(word) for word in words[4:]]
        except (ValueError, IndexError):
            raise MeshError(f"line {number}: expected a camera, got {line[:60]!r}") from None
        yield camera, (_intrinsics_of(camera, words[1], params), size)


def _images_in_text(data: bytes) -> Iterator[_Image]:
    """Yield images. Each image has two lines; the second lists image points and may be empty."""
    lines = _lines_of(data)
    for number, line in lines:
        words = line.split(maxsplit=9)
        if not words:
            continue
        try:
            numbers = [float(word) for word in words[1:8]]
            camera, name = int(words[8]), words[9]
        except (ValueError, IndexError):
            raise MeshError(f"line {number}: expected an image, got {line[:60]!r}") from None
        yield name, camera, numbers
        next(lines, None)


def _cameras_in_binary(data: bytes) -> Iterator[tuple[int, _Camera]]:
    reader = BinaryReader(data)
    for _ in range(reader.take("Q")[0]):
        camera, number, width, height = reader.take("IiQQ")
        name = _NAMES.get(number, str(number))
        known = _MODELS.get(name)
        n_params = known.n_focal + 2 + known.n_distortion if known else 0
        params = list(reader.take(f"{n_params}d"))
        yield camera, (_intrinsics_of(camera, name, params), (width, height))


def _images_in_binary(data: bytes) -> Iterator[_Image]:
    reader = BinaryReader(data)
    for _ in range(reader.take("Q")[0]):
        _, *numbers, camera = reader.take("I7dI")
        name = reader.text()
        yield name, camera, numbers
        reader.skip(24 * reader.take("Q")[0])  # skip image points: x, y and the id of a 3D point


_CAMERAS = {".bin": _cameras_in_binary, ".txt": _cameras_in_text}
_IMAGES = {".bin": _images_in_binary, ".txt": _images_in_text}
