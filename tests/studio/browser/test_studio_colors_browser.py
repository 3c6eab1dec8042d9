"""Labeled cells keep the hue of their class on colored meshes; touching objects differ."""

import base64
import json

import numpy as np
import shapes
from textured_meshes import grid

import superfacets as sf
from superfacets import MeshAttributes
from superfacets_show.colors import oklab

OWN = [(40, 120, 50), (200, 190, 170), (60, 40, 110), (150, 60, 40), (90, 90, 90), (30, 30, 35)]
"""Own colors of the mesh, in columns; the classes are in rows."""


def paint(server, cells, class_id, object_id=0):
    text = base64.b64encode(np.asarray(cells, "<u4").tobytes()).decode()
    body = {"class": class_id, "object": object_id, "cells": text}
    server.request("files/0/paint", data=json.dumps(body).encode())


def places_of(mesh):
    """Return column and row, 0 to 5, of each face of a square wall."""
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return (
        np.floor(6 * (centers - low) / np.where(high > low, high - low, 1)).astype(int)[:, [0, 2]].T
    )


def pixels_of(tab, cells):
    tab.locator("#borders").uncheck()
    tab.evaluate("document.activeElement.blur()")
    tab.away()
    script = "cell => { const { x, y } = studio.screenOf(cell); return studio.pixelAt(x, y); }"
    return np.array([tab.evaluate(script, int(cell)) for cell in cells])


def test_labeled_cells_have_the_hue_of_the_class_and_the_lightness_of_the_mesh(
    serve, open_tab, tmp_path
):
    mesh, _ = grid(24, 24, 1, 1)
    columns, rows = places_of(mesh)
    own = MeshAttributes(
        face=dict(zip(("red", "green", "blue"), np.array(OWN)[columns].T, strict=True))
    )
    sf.write_mesh(tmp_path / "wall.ply", mesh, attributes=own)
    server = serve(tmp_path / "wall.ply", 1)  # regions differ in lightness
    for row in range(6):
        paint(server, np.flatnonzero(rows == row), row + 1)
    tab = open_tab(server.address)
    tab.until("studio.workbench.drawing.ownColors.isShown")
    assert tab.locator("#texture").input_value() == "0.5"
    cells = [np.flatnonzero((columns == i % 6) & (rows == i // 6))[5] for i in range(36)]
    found = oklab(pixels_of(tab, cells)).reshape(6, 6, 3)
    codes = [entry["color"] for entry in server.state()["classes"]]
    wanted = oklab(np.array([[*bytes.fromhex(code[1:])] for code in codes]))[:, np.newaxis]
    hues = [np.arctan2(colors[..., 2], colors[..., 1]) for colors in (found, wanted)]
    assert np.degrees(np.abs(np.angle(np.exp(1j * (hues[0] - hues[1]))))).max() < 6
    chromas = [np.hypot(colors[..., 1], colors[..., 2]) for colors in (found, wanted)]
    assert (chromas[0] / chromas[1]).min() > 0.4  # dark colors of full chroma do not exist
    assert (np.diff(found[:, np.argsort(oklab(np.array(OWN))[:, 0]), 0], axis=1) > -0.01).all()


def test_objects_that_touch_have_different_shades(serve, open_tab, tmp_path):
    """Objects 1 and 6 touch, as do 2 and 7; they had the same shade."""
    mesh, _ = grid(24, 24, 1, 1)
    columns, rows = places_of(mesh)
    sf.write_mesh(tmp_path / "wall.ply", mesh)
    server = serve(tmp_path / "wall.ply", 60)
    objects = np.where(rows == 2, columns + 1, np.where(rows == 3, columns + 6, 0))
    for number in range(1, 12):
        paint(server, np.flatnonzero(objects == number), 3, number)
    tab = open_tab(server.address)
    colors = tab.evaluate(
        "[...Array(11).keys()].map((k) => studio.workbench.paintColor(((k + 1) << 16) | 3))"
    )
    touching = {(objects[a], objects[b]) for a, b in pairs_of(mesh) if 0 < objects[a] < objects[b]}
    assert {(1, 6), (2, 7), (6, 7)} <= touching
    assert all(colors[a - 1] != colors[b - 1] for a, b in touching)
    assert colors[0] != colors[1]
    cells = [np.flatnonzero(objects == number)[9] for number in range(1, 12)]
    shades = [[int(value) for value in color[4:-1].split(",")] for color in colors]
    directions = [np.array(values) / np.linalg.norm(values, axis=1)[:, None] for values in
                  (pixels_of(tab, cells).astype(float), np.array(shades, float))]  # fmt: skip
    np.testing.assert_allclose(*directions, atol=0.03)  # as in the list, but for the lighting


def pairs_of(mesh):
    """Yield all pairs of faces with a common edge, in both orders."""
    graph = sf.build_face_graph(mesh)
    for face, (begin, end) in enumerate(zip(graph.offsets, graph.offsets[1:], strict=False)):
        for other in graph.neighbors[begin:end]:
            yield face, other


def test_the_edge_of_an_object_shows_on_an_unlabeled_wall_behind_it(serve, open_tab, tmp_path):
    wall, _ = grid(24, 24, 1, 1)
    shift = 0.7 * wall.vertices.mean(axis=0) + 0.4 * np.ptp(wall.vertices) * np.array([0, 1, 0])
    board = sf.Mesh(0.3 * wall.vertices + shift, wall.faces)
    sf.write_mesh(tmp_path / "wall.ply", shapes.together([wall, board]))
    server = serve(tmp_path / "wall.ply", 2)
    paint(server, [0], 1)  # all other cells are gray
    tab = open_tab(server.address)
    tab.evaluate("studio.workbench.drawing.camera.turnTo(0, 1.57)")
    tab.locator("#borders").uncheck()
    tab.away()
    light = tab.evaluate("""[...Array(canvas.clientWidth).keys()].map(
        (x) => studio.pixelAt(x, canvas.clientHeight / 2)[0])""")
    assert min(light) < 0.8 * np.median(light)
