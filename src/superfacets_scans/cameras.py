"""Read cameras of images: COLMAP models, transforms.json, and folders with one file per pose."""

from __future__ import annotations

import math
import os
from collections.abc import Container, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import MeshError
from superfacets.kit import Floats, StrPath, named_errors, read_content

from .colmap import UNDISTORT, PosedImage, is_colmap, read_colmap
from .pinhole_camera import PinholeCamera
from .scannet import read_json

_WITHOUT_DISTORTION = ("PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "RADIAL")
"""Camera models of transforms.json that have no distortion if all coefficients are 0."""

_COEFFICIENTS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")


def read_cameras(
    path: StrPath,
    *,
    intrinsics: StrPath | npt.ArrayLike | None = None,
    size: tuple[int, int] | None = None,
    names: Container[str] | None = None,
) -> list[PinholeCamera]:
    r"""Read the cameras of images. Poses are in the coordinate system of the file.

    Parameters
    ----------
    path : path-like
        One of the following:

        - a COLMAP model: a folder with the files ``cameras`` and ``images``, as ``.bin`` or
          ``.txt``;
        - a ``.json`` file with ``frames``, as used by NeRF, instant-ngp and nerfstudio;
        - a folder with one ``.txt`` file per image, as in ScanNet. Each file has the 4 x 4 matrix
          from camera to world, with camera axes as in OpenCV.
    intrinsics : path-like or array_like, optional
        Intrinsics as for `PinholeCamera`, or a text file with these numbers. Used only for a folder
        of poses.
    size : (int, int), optional
        Width and height of the images in pixels, for a folder of poses, or for a ``.json`` file
        without ``w`` and ``h``.
    names : container of str, optional
        Names of the images to read, without folders and suffixes. Other images are ignored.

    Returns
    -------
    list of PinholeCamera
        Cameras in the order of the file. Cameras of a folder of poses are sorted by the length of
        the name, then by name, so that 9 comes before 10. The name of a camera is the file name of
        its image, or the name of its pose file without ``.txt``.

    Raises
    ------
    MeshError
        If a file is damaged, if a pose is not a rotation and a translation, if a camera has
        distortion, if two images have the same name, or if there is no image to read.
    ValueError
        If `intrinsics` or `size` is missing for a folder of poses.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "7.txt").write_text("1 0 0 2\n0 1 0 0\n0 0 1 0\n0 0 0 1")
    ...     read_cameras(folder, intrinsics=(500, 500, 320, 240), size=(640, 480))
    [PinholeCamera('7', 640 x 480, at [2.0, 0.0, 0.0])]
    """
    path = Path(path)
    if not path.is_dir():
        images = _in_json(path, size)
    elif is_colmap(path):
        images = iter(read_colmap(path))
    else:
        images = _in_folder(path, intrinsics, size, names)
    cameras: dict[str, PinholeCamera] = {}
    for image in images:
        name = PurePosixPath(image.name.replace("\\", "/"))
        if names is not None and name.stem not in names:
            continue
        if name.stem in cameras:
            raise MeshError(
                f"{path}: image names without folder and ending must differ, but two images are"
                f" named {name.stem}"
            )
        try:
            make = PinholeCamera.of_opengl if image.is_opengl else PinholeCamera
            cameras[name.stem] = make(image.pose, image.intrinsics, image.size, name.name)
        except (ValueError, TypeError) as error:
            raise MeshError(f"{path}: image {image.name}: {error}") from None
    if not cameras:
        which = "" if names is None else " with one of the given names"
        raise MeshError(f"{path}: there is no image{which}")
    return list(cameras.values())


def _in_folder(
    folder: Path, intrinsics: Any, size: Any, names: Container[str] | None
) -> Iterator[PosedImage]:
    paths = [path for path in folder.glob("*.txt") if names is None or path.stem in names]
    if not paths:
        raise MeshError(
            f"{folder}: expected a COLMAP model (cameras and images, .bin or .txt) or poses (one"
            " .txt file of 4 x 4 numbers per image)"
        )
    if intrinsics is None or size is None:
        raise ValueError(f"{folder}: intrinsics and size must be given for a folder of poses")
    if isinstance(intrinsics, (str, os.PathLike)):
        intrinsics = _matrix_in(Path(intrinsics))
    for path in sorted(paths, key=lambda path: (len(path.stem), path.stem)):
        yield PosedImage(path.stem, _matrix_in(path), intrinsics, size)


def _matrix_in(path: Path) -> Floats:
    rows = [line.split() for line in bytes(read_content(path)).splitlines() if line.strip()]
    try:
        matrix = np.array(rows, np.float64)
    except ValueError:
        raise MeshError(f"{path}: the rows of the matrix must have the same length") from None
    return matrix[0] if len(matrix) == 1 else matrix


def _in_json(path: Path, size: Any) -> Iterator[PosedImage]:
    document = read_json(path)
    frames = document.get("frames") if isinstance(document, dict) else None
    if not isinstance(frames, list) or not all(isinstance(frame, dict) for frame in frames):
        raise MeshError(f"{path}: expected a JSON object with a list of frames")
    for place, frame in enumerate(frames):
        with named_errors(f"{path}: frames[{place}]"):
            yield _image_of({**document, **frame}, size)


def _image_of(values: dict[str, Any], size: Any) -> PosedImage:
    """Return the image of a frame; `values` are the entries of the document and of the frame."""
    model = values.get("camera_model", "PINHOLE")
    if model not in _WITHOUT_DISTORTION or values.get("is_fisheye"):
        raise MeshError(f"the camera has the model {model}: {UNDISTORT}")
    if any(values.get(name) for name in _COEFFICIENTS):
        raise MeshError(f"the camera has distortion: {UNDISTORT}")
    try:
        if "w" in values and "h" in values:
            size = int(values["w"]), int(values["h"])
        if size is None:
            raise MeshError("w or h is missing: pass size=(width, height) of the images")
        width, height = size
        fx = _focal_length(values, "x", width)
        fy = _focal_length(values, "y", height) or fx
        if fx is None or fy is None:
            raise MeshError("fl_x and camera_angle_x are missing: one of them is required")
        center = float(values.get("cx", width / 2)), float(values.get("cy", height / 2))
        name, pose = str(values["file_path"]), np.array(values["transform_matrix"], np.float64)
    except KeyError as error:
        raise MeshError(f"{error.args[0]} is missing") from None
    except MeshError:
        raise
    except (TypeError, ValueError, ArithmeticError):
        raise MeshError("sizes, focal lengths, centers and matrices must be numbers") from None
    return PosedImage(name, pose, (fx, fy, *center), size, True)


def _focal_length(values: dict[str, Any], axis: str, n_pixels: int) -> float | None:
    if f"fl_{axis}" in values:
        return float(values[f"fl_{axis}"])
    angle = values.get(f"camera_angle_{axis}")
    return None if angle is None else n_pixels / (2 * math.tan(float(angle) / 2))
