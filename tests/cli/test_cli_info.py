"""The command `info`."""

import json
import re

import numpy as np
import pytest
import shapes

from superfacets import Mesh, MeshAttributes, PointCloud, write_mesh
from superfacets_formats.las_frame import LasFrame


def test_info_prints_counts(run, sheet):
    status, out, err = run("info", sheet)
    assert (status, err) == (0, "")
    rows = dict(re.split(r" {2,}", line, maxsplit=1) for line in out.splitlines())
    assert rows["faces"] == "1152"
    assert rows["boundary edges"] == "96"
    assert rows["inside out"] == "unknown (open)"
    facts = json.loads(run("info", sheet, "--json")[1])
    assert facts["is_inside_out"] is None
    assert facts["n_faces"] == 1152
    assert facts["n_boundary_edges"] == 96


def test_info_lists_what_the_file_declares_and_what_became_of_it(run, tmp_path):
    text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nvn 0 0 1\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    out = run("info", tmp_path / "a.obj")[1]
    assert out.splitlines()[-3:] == [
        "cells                3 vertices; 1 face",
        "attributes           vertex property red; vertex property green; vertex property blue",
        "left out             vn (normals)",
    ]
    facts = json.loads(run("info", tmp_path / "a.obj", "--json")[1])
    assert facts["cells"] == ["3 vertices", "1 face"]
    assert facts["left_out"] == ["vn (normals)"]


def test_formats_name_the_extra_that_reading_needs(run):
    rows = {line.split()[0]: line.split() for line in run("formats")[1].splitlines()}
    extras = [rows[ending][3] for ending in (".vtk", ".msh", ".laz", ".e57")]
    assert extras == ["viz", "mesh", "las", "e57"]
    kinds = {rows[ending][1] for ending in (".curv", ".area", ".shape.gii")}
    assert (kinds, rows[".annot"][1]) == ({"values"}, "labels")


def test_info_says_where_regions_would_become_stripes(run, tmp_path):
    path = tmp_path / "block.ply"
    write_mesh(path, shapes.drilled_block(256))
    status, out, err = run("info", path)
    assert status == 0
    assert "sliver share         0.37" in out
    assert err == (
        f"superfacets: note: {path}: 37% of the area is in faces that are long and thin compared"
        " with the regions, so regions may be stripes: try segment --subdivide\n"
    )
    assert json.loads(run("info", path, "--json")[1])["sliver_share"] > 0.3


def test_info_says_that_terrain_faces_down(run, tmp_path):
    path, sheet = tmp_path / "terrain.ply", shapes.bumpy_sheet(6)
    write_mesh(path, Mesh(sheet.vertices, sheet.faces[:, ::-1]))
    status, _, err = run("info", path)
    assert status == 0
    assert err.startswith(f"superfacets: note: {path}: if z is up, this open surface faces down:")
    assert json.loads(run("info", path, "--json")[1])["faces_down"]


def test_info_takes_several_files_and_goes_on_after_a_bad_one(run, sheet):
    bad = sheet.with_name("bad.ply")
    bad.write_bytes(b"junk")
    status, out, err = run("info", sheet, bad, sheet)
    assert status == 1
    assert (
        err == f"superfacets: error: {bad}: not a PLY file: it does not begin with the word ply\n"
        "superfacets: error: 1 of 3 files failed\n"
    )
    files = [line.split()[1] for line in out.splitlines() if line.startswith("file ")]
    assert files == [str(sheet)] * 2
    status, out, _ = run("info", sheet, sheet, "--json")
    assert [json.loads(line)["file"] for line in out.splitlines()] == [str(sheet)] * 2


def test_info_prints_version_and_reference_system_of_las(run, tmp_path):
    pytest.importorskip("laspy")
    path = tmp_path / "tile.las"
    points = np.random.default_rng(0).random((30, 3))
    frame = LasFrame(2, 3, (0.01,) * 3, (0.0,) * 3, ((34735, bytes(8)),))
    write_mesh(path, PointCloud(points), attributes=MeshAttributes(header=frame))
    status, out, err = run("info", path)
    assert (status, err) == (0, "")
    assert [line.rsplit(maxsplit=1) for line in out.splitlines()[-3:]] == [
        ["LAS version", "1.2"],
        ["point format", "3"],
        ["reference system", "GeoTIFF"],
    ]
    facts = json.loads(run("info", path, "--json")[1])
    assert (facts["LAS_version"], facts["point_format"]) == ("1.2", 3)
    write_mesh(path, PointCloud(points))
    assert run("info", path)[1].endswith("reference system     none\n")
