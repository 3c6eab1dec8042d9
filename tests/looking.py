"""Cameras around and in meshes, and masks drawn from labels."""

import numpy as np

import superfacets as sf
from superfacets import _core
from superfacets_scans import project_labels


def camera_at(position, target, size=(64, 48), focal=50.0, name=""):
    """Return a camera at a position that looks at a target, with z up."""
    ahead = np.subtract(target, position).astype(float)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1] if abs(ahead[2]) < 0.99 else [0, 1, 0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(ahead, right), ahead, position], axis=1)
    return sf.PinholeCamera(pose, (focal, focal, size[0] / 2, size[1] / 2), size, name)


def cameras_in_room(bounds, n, size=(160, 120)):
    """Return cameras that walk around the middle of a room and face the walls or the floor."""
    low, high = bounds
    middle = (low + high) / 2
    cameras = []
    for step in range(n):
        angle = 2 * np.pi * step / n
        side = np.array([np.cos(angle), np.sin(angle), 0])
        place = middle + 0.25 * (high - low) * side
        place[2] = low[2] + 0.7 * (high - low)[2]
        ahead = side if step % 2 else -side
        target = place + ahead - [0, 0, 0.3 + 0.25 * (step % 3)]
        cameras.append(camera_at(place, target, size, 0.6 * size[0], f"{step:03d}.png"))
    return cameras


def see(mesh, cameras, n_threads=1):
    """Return the triangles, the areas, and whether each triangle is seen, from the kernel."""
    rows = np.array(
        [[*camera.projection.ravel(), np.prod(camera.intrinsics[:2])] for camera in cameras]
    )
    sizes = np.array([camera.size for camera in cameras], np.int32).ravel()
    return _core.see_surface(mesh.vertices, mesh.faces, rows, sizes, n_threads)


def masks_of(mesh, labels, cameras):
    """Return mask ids for each camera: the label of the visible face plus 1, or 0."""
    return [image + 1 for image in project_labels(mesh, labels, cameras)]
