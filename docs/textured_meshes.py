"""Textured meshes made by code: ``python textured_meshes.py FOLDER`` writes the facade as OBJ.

``python docs/textured_meshes.py --picture`` also draws the picture of the page on textures. The
facade is flat, and its windows and door are only in the texture. The texture of the ball is a
chessboard. The script requires Pillow.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from superfacets import (
    Mesh,
    MeshAttributes,
    Texture,
    face_colors,
    segment,
    write_labels,
    write_mesh,
)
from superfacets_textures import Material, TextureImage
from superfacets_textures.texels import ids_in_layout

PIXELS_PER_METER = 100
WALL, PLINTH, DOOR, FIRST_WINDOW = range(4)

PAINT = {WALL: (222, 205, 172), PLINTH: (128, 122, 118), DOOR: (92, 40, 30)}
FRAME, GLASS = (84, 62, 48), (70, 92, 112)


class Textured(NamedTuple):
    """Mesh with a texture, and the painted part of each face."""

    mesh: Mesh
    texture: Texture
    parts: np.ndarray[Any, Any]


def facade(folder: Path, width: float = 12.0, height: float = 9.0, edge: float = 0.1) -> Textured:
    """Return a wall of faces of size `edge`, painted with windows, a door and a base."""
    pixels, parts = paint(width, height)
    path = folder / "facade.png"
    save_png(path, pixels)
    mesh, coordinates = grid(round(width / edge), round(height / edge), width, height)
    corners = mesh.faces.ravel()
    material = Material("facade", image=TextureImage(path.name, path))
    texture = Texture(coordinates, corners, [material], np.zeros(mesh.n_faces, np.int32))
    middles = coordinates[mesh.faces].mean(axis=1)
    rows = ((1 - middles[:, 1]) * parts.shape[0]).astype(int)
    columns = (middles[:, 0] * parts.shape[1]).astype(int)
    return Textured(mesh, texture, parts[rows, columns])


def paint(width: float, height: float) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return the image of the facade, and the painted part at each pixel."""
    shape = round(height * PIXELS_PER_METER), round(width * PIXELS_PER_METER)
    parts = np.full(shape, WALL)
    y, x = (np.indices(shape) + 0.5) / PIXELS_PER_METER
    y = height - y
    parts[y < 0.8] = PLINTH
    parts[(abs(x - width / 2) < 0.75) & (y < 2.6)] = DOOR
    pixels = np.zeros((*shape, 3))
    part = FIRST_WINDOW
    is_glass = np.zeros(shape, bool)
    for floor in range(3):
        for column in range(5):
            right, up = abs(x - (column + 0.5) * width / 5), abs(y - (1.9 + 2.75 * floor))
            if floor == 0 and column == 2:
                continue  # the door
            parts[(right < 0.55) & (up < 0.75)] = part
            is_glass |= (right < 0.47) & (right > 0.04) & (up < 0.67)
            part += 1
    for number in np.unique(parts):
        pixels[parts == number] = PAINT.get(int(number), FRAME)
    pixels[is_glass] = GLASS
    pixels += np.random.default_rng(27).normal(0, 5, shape)[
        :, :, np.newaxis
    ]  # noise of a photograph
    return np.clip(np.rint(pixels), 0, 255).astype(np.uint8), parts


def grid(
    n_columns: int, n_rows: int, width: float, height: float
) -> tuple[Mesh, np.ndarray[Any, Any]]:
    """Return an upright rectangle of triangles, and the texture coordinates of its vertices."""
    u, v = np.meshgrid(np.linspace(0, 1, n_columns + 1), np.linspace(0, 1, n_rows + 1))
    coordinates = np.stack([u.ravel(), v.ravel()], axis=1)
    vertices = np.zeros((coordinates.shape[0], 3))
    vertices[:, [0, 2]] = coordinates * (width, height)
    place = np.arange(len(vertices)).reshape(n_rows + 1, n_columns + 1)
    a, b, c, d = place[:-1, :-1], place[:-1, 1:], place[1:, 1:], place[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    return Mesh(vertices, faces), coordinates


def checkered_ball(folder: Path, n_squares: int = 8, n_rows: int = 96) -> Textured:
    """Return a sphere of radius 1 with a chessboard of 2 n x n squares around it."""
    size = 16  # pixels per square
    board = (np.indices((n_squares, 2 * n_squares)).sum(axis=0) % 2).astype(np.uint8)
    pixels = np.repeat(np.repeat(board, size, axis=0), size, axis=1)[:, :, np.newaxis]
    path = folder / "board.png"
    save_png(path, np.where(pixels == 1, (230, 225, 210), (60, 45, 40)).astype(np.uint8))
    flat, coordinates = grid(2 * n_rows, n_rows, 1, 1)
    longitude, latitude = coordinates.T * [[2 * np.pi], [np.pi]] - [[0], [np.pi / 2]]
    around = np.stack([np.cos(longitude), np.sin(longitude)]) * np.cos(latitude)
    vertices = np.round(np.vstack([around, np.sin(latitude)]).T, 12)  # the seam is closed exactly
    mesh = Mesh(vertices, flat.faces)
    texture = Texture(
        coordinates, mesh.faces.ravel(), [Material("board", image=TextureImage(path.name, path))],
        np.zeros(mesh.n_faces, np.int32),
    )  # fmt: skip
    middles = coordinates[mesh.faces].mean(axis=1)
    squares = (middles * (2 * n_squares, n_squares)).astype(int)
    return Textured(mesh, texture, squares[:, 1] * 2 * n_squares + squares[:, 0])


def save_png(path: Path, pixels: np.ndarray[Any, Any]) -> None:
    """Write an image."""
    from PIL import Image

    Image.fromarray(pixels).save(path)


def write_facade(folder: Path) -> None:
    """Write ``facade.obj`` with its materials and image, and the painted parts of its faces."""
    made = facade(folder)
    write_mesh(folder / "facade.obj", made.mesh, attributes=MeshAttributes(texture=made.texture))
    write_labels(folder / "facade.seg", made.parts)


def draw_facade(folder: Path, picture: Path) -> None:
    """Draw side by side the facade, its regions without texture, and its regions with texture."""
    from PIL import Image

    made = facade(folder)
    panels = [np.asarray(Image.open(folder / "facade.png"))]
    for features in (None, "texture"):
        labels = segment(folder / "facade.obj", 200, features=features).labels
        everywhere = np.ones(made.mesh.n_faces, bool)
        ids = ids_in_layout(
            made.mesh, made.texture, labels, everywhere, ("repeat", "repeat"), (1200, 900)
        )
        table = np.zeros((labels.max() + 1, 3))
        table[labels] = face_colors(made.mesh, labels)
        drawn = 0.45 * table[ids] + 0.55 * panels[0]
        is_border = np.zeros(ids.shape, bool)
        is_border[:, 1:] |= np.diff(ids, axis=1) != 0
        is_border[1:] |= np.diff(ids, axis=0) != 0
        drawn[is_border] = 20
        panels.append(np.rint(drawn).astype(np.uint8))
    image = Image.fromarray(np.concatenate(panels, axis=1))
    small = image.resize((1200, 300), Image.Resampling.LANCZOS)
    small.save(picture, quality=90, method=6)


if __name__ == "__main__":
    if sys.argv[1:] == ["--picture"]:
        from tempfile import TemporaryDirectory

        with TemporaryDirectory() as temporary:
            write_facade(Path(temporary))
            images = Path(__file__).resolve().parent / "images"
            draw_facade(Path(temporary), images / "howto-facade.webp")
    else:
        write_facade(Path(sys.argv[1]))
