"""A tileset of 3D Tiles on the earth: a sheet in four models, linked in many ways."""

import json
import struct

import numpy as np
from shapes import bumpy_sheet

from superfacets import Mesh, write_mesh

CENTER = np.array([4501000.25, 700000.5, 4400000.75])
"""Position of the sheet, in earth-centered coordinates, in meters."""

ORIGIN = (4501000.0, 700000.0, 4400001.0)
"""`CENTER` rounded to meters."""

SOUTH_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Rotation from the sheet, z up, to the earth."""


def by_columns(rotation=None, shift=(0.0, 0.0, 0.0)) -> list[float]:
    """Return the matrix as the `transform` of a tile."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if rotation is None else rotation
    matrix[:3, 3] = shift
    return matrix.T.ravel().tolist()


def write_glb(path, vertices, faces):
    """Write a mesh with z up as a GLB with y up."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_mesh(path, Mesh(vertices[:, [0, 2, 1]] * [1, 1, -1], faces))


def write_b3dm(path, vertices, faces, center):
    """Write the same mesh as .b3dm, with the offset `center` in the header."""
    write_glb(path.with_suffix(".glb"), vertices, faces)
    model = path.with_suffix(".glb").read_bytes()
    path.with_suffix(".glb").unlink()
    text = json.dumps({"BATCH_LENGTH": 0, "RTC_CENTER": list(center)}).encode()
    text += b" " * (-(28 + len(text)) % 8)
    sizes = (28 + len(text) + len(model), len(text), 0, 0, 0)
    path.write_bytes(struct.pack("<4s6I", b"b3dm", 1, *sizes) + text + model)


def write_tileset(path, root, **asset):
    path.parent.mkdir(parents=True, exist_ok=True)
    volume = {"sphere": [0, 0, 0, 100]}
    document = {
        "asset": {"version": "1.0", **asset},
        "geometricError": 500,
        "root": {"boundingVolume": volume, "geometricError": 100, "refine": "REPLACE", **root},
    }
    path.write_text(json.dumps(document))
    return path


def sheet_in_parts():
    """Return a sheet, and the vertices and faces of its quarters, strips along y."""
    sheet = bumpy_sheet(24)
    order = np.argsort(sheet.vertices[sheet.faces, 0].mean(axis=1), kind="stable")
    exact = np.rint(sheet.vertices * 4096) / 4096  # exact in single precision
    sheet = Mesh(exact, sheet.faces[order])
    parts = []
    for faces in np.split(sheet.faces, 4):
        used, corners = np.unique(faces, return_inverse=True)
        parts.append((sheet.vertices[used], corners.reshape(-1, 3).astype(np.int32)))
    return sheet, parts


def write_city(folder):
    """Write the tileset; return its file, and the sheet at its place."""
    sheet, (one, two, three, four) = sheet_in_parts()
    write_glb(folder / "coarse.glb", *one)
    write_glb(folder / "data" / "one.glb", *one)
    write_b3dm(folder / "data" / "two.b3dm", two[0] - [5, 6, 7], two[1], [5, 6, 7])
    write_glb(folder / "sub" / "three 3.glb", three[0] - [0, 0, 2], three[1])
    write_glb(folder / "sub" / "four.glb", *four)
    both = [{"uri": "three%203.glb?v=1"}]
    write_tileset(
        folder / "sub" / "more.json",
        {
            "refine": "ADD",
            "transform": by_columns(shift=(0, 0, 2)),
            "contents": both,
            "children": [
                {"content": {"url": "four.glb"}, "transform": by_columns(shift=(0, 0, -2))}
            ],
        },
        version="1.1",
    )
    root = {
        "transform": by_columns(SOUTH_UP, CENTER),
        "content": {"uri": "coarse.glb"},
        "children": [
            {"content": {"uri": "data/one.glb"}},
            {"content": {"uri": "./data/two.b3dm"}},
            {"content": {"uri": "sub/more.json"}},
        ],
    }
    moved = sheet.vertices @ SOUTH_UP.T + (CENTER - ORIGIN)
    return write_tileset(folder / "tileset.json", root), Mesh(moved, sheet.faces)
