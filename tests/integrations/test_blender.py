"""The Blender extension: its array functions, the archive, and runs in bpy if it is installed."""

import importlib.util
import json
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import shapes

import superfacets as sf

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "integrations/blender"
TOOL = ROOT / "tools/make-blender-extension"

# Two squares and a triangle in a row, as Blender stores them:
#
#   4---5---6
#   |   |   | 7
#   0---1---2
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 9, 9], [0, 1, 0], [1, 1, 0], [2, 1, 0], [3, 0.5, 0]],
    np.float32,
)
LOOP_STARTS = np.array([0, 4, 8], np.int32)
LOOP_VERTICES = np.array([0, 1, 5, 4, 1, 2, 6, 5, 2, 7, 6], np.int32)
# 0: 0-1, 1: 1-5, 2: 5-4, 3: 4-0, 4: 1-2, 5: 2-6, 6: 6-5, 7: 2-7, 8: 7-6
LOOP_EDGES = np.array([0, 1, 2, 3, 4, 5, 6, 1, 7, 8, 5], np.int32)


@pytest.fixture(scope="module")
def faces():
    spec = importlib.util.spec_from_file_location("blender_faces", FOLDER / "faces.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_polygons_keep_their_corners(faces):
    mesh = faces.polygons_of(CORNERS, LOOP_STARTS, LOOP_VERTICES, np.eye(4))
    assert isinstance(mesh, sf.PolygonMesh)
    found = [mesh.face(i).tolist() for i in range(mesh.n_faces)]
    assert found == [[0, 1, 5, 4], [1, 2, 6, 5], [2, 7, 6]]
    assert np.array_equal(mesh.vertices, CORNERS)


def test_triangles_alone_are_a_mesh_of_triangles(faces):
    sheet = shapes.bumpy_sheet(4)
    starts = np.arange(0, 3 * sheet.n_faces, 3)
    mesh = faces.polygons_of(sheet.vertices, starts, sheet.faces.ravel(), np.eye(4))
    assert isinstance(mesh, sf.Mesh)
    assert np.array_equal(mesh.faces, sheet.faces)


def test_the_size_of_the_object_counts_and_its_place_does_not(faces):
    matrix = np.diag([2.0, 1.0, 1.0, 1.0])
    matrix[:3, 3] = 1e6
    mesh = faces.polygons_of(CORNERS, LOOP_STARTS, LOOP_VERTICES, matrix)
    assert np.array_equal(mesh.vertices, CORNERS * [2, 1, 1])
    flat = faces.polygons_of(CORNERS, LOOP_STARTS, LOOP_VERTICES, np.diag([1, 0, 1]))
    assert np.array_equal(flat.vertices, CORNERS)


def test_there_are_no_more_regions_than_polygons(faces):
    mesh = faces.polygons_of(CORNERS, LOOP_STARTS, LOOP_VERTICES, np.eye(4))
    result = faces.segment_polygons(mesh, 150, follow_ridges=0.0, keep_islands=True)
    assert sorted(result.labels.tolist()) == [0, 1, 2]


def test_options_are_those_of_segment(faces):
    islands = shapes.two_islands()
    with pytest.warns(sf.IslandWarning):
        kept = faces.segment_polygons(islands, 1, follow_ridges=0.2, keep_islands=True)
    assert (kept.n_segments, kept.params["eta_convex"]) == (2, 0.2)
    joined = faces.segment_polygons(islands, 1, follow_ridges=0.0, keep_islands=False)
    assert joined.n_segments == 1


def test_face_sets_begin_at_one(faces):
    sets = faces.face_sets(np.array([0, 2, 1], np.int32))
    assert (sets.tolist(), sets.dtype) == ([1, 3, 2], np.int32)


def test_border_edges_lie_between_regions(faces):
    labels = np.array([0, 0, 1], np.int32)
    is_border = faces.border_edges(LOOP_EDGES, LOOP_STARTS, labels, 10)  # edge 9 has no polygon
    assert np.flatnonzero(is_border).tolist() == [5]
    one = np.zeros(3, np.int32)
    assert not faces.border_edges(LOOP_EDGES, LOOP_STARTS, one, 10).any()


def test_the_manifest_is_as_blender_wants_it():
    manifest = tomllib.loads((FOLDER / "blender_manifest.toml").read_text())
    assert manifest["version"] == sf.__version__
    assert re.fullmatch(r"[^.]{1,64}", manifest["tagline"])
    assert manifest["license"] == ["SPDX:MIT"]
    assert set(manifest) >= {"schema_version", "id", "name", "maintainer", "type"}


def test_the_archive_holds_the_extension_and_its_wheels(tmp_path):
    target, wheel = tmp_path / "out" / "superfacets.zip", tmp_path / "superfacets-1-py3.whl"
    wheel.write_bytes(b"a wheel")
    command = [sys.executable, TOOL, target]
    subprocess.run([*command, wheel], check=True, capture_output=True)
    with zipfile.ZipFile(target) as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert names == {
        "__init__.py", "faces.py", "blender_manifest.toml", "LICENSE", f"wheels/{wheel.name}",
    }  # fmt: skip
    assert manifest["wheels"] == [f"./wheels/{wheel.name}"]
    subprocess.run(command, check=True, capture_output=True)
    with zipfile.ZipFile(target) as archive:
        assert "wheels" not in tomllib.loads(archive.read("blender_manifest.toml").decode())
    done = subprocess.run(command[:2], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr.startswith("usage")) == (1, True)


@pytest.fixture(scope="module")
def scene():
    """Return the results of the extension in Blender, keyed by case."""
    if find_spec("bpy") is None:
        pytest.skip("bpy is not installed")
    script = Path(__file__).with_name("blender_scene.py")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return {entry["case"]: entry["value"] for entry in map(json.loads, lines)}


def test_blender_gets_face_sets_an_attribute_and_seams(scene):
    monkey = scene["monkey"]
    assert monkey["status"] == ["FINISHED"]
    vertices = np.reshape(monkey["positions"], (-1, 3)) * [1, 2, 1]
    mesh = sf.PolygonMesh(vertices, monkey["offsets"], monkey["corners"])
    expected = sf.segment(mesh, 20)
    assert monkey["labels"] == expected.labels.tolist()
    assert monkey["sets"] == (expected.labels + 1).tolist()
    assert monkey["n_seams"] > 20


def test_blender_is_in_the_mode_it_was_in(scene):
    assert scene["modes"] == {"modes": ["EDIT", "SCULPT", "OBJECT"], "has_attribute": False}


def test_blender_says_what_it_cannot_do(scene):
    other_type, no_polygons = scene["refused"]
    assert "an attribute 'superfacets' that is not of integers of faces" in other_type
    assert "face" in no_polygons
    assert scene["gone"] is True
