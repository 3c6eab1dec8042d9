"""The routes of the studio."""

import asyncio
import contextlib
import errno
import json
import os
import sys
import threading
import time
from pathlib import Path

import httpx
import numpy as np
import pytest
import shapes
from studio_client import PORT, TOKEN, decoded, encoded, unpacked

import superfacets
from superfacets import PointCloud, PolygonMesh, RenderError, write_mesh
from superfacets_show.backend import ensure_gl
from superfacets_show.colors import PALETTE
from superfacets_studio.regions import segmenting
from superfacets_studio.regions.revisions import MAX_KEPT, similar_regions
from superfacets_studio.web.messages import message_of
from superfacets_studio.web.thumbnails import Thumbnails


def test_the_mesh_is_as_in_the_file(client, sheet):
    header, arrays = unpacked(client.get("mesh").content)
    mesh = superfacets.read_mesh(sheet)
    n_triangles = len(arrays["triangles"])
    assert (header["kind"], header["n_cells"], n_triangles) == ("triangles", 1152, 1152)
    corners = arrays["positions"][arrays["triangles"]] + header["center"]
    assert np.allclose(corners, mesh.vertices[mesh.faces], atol=1e-6)
    assert header["palette"] == PALETTE.tolist()  # regions have the colors of pictures
    assert arrays["areas"].sum() == pytest.approx(client.document().areas.sum())
    client.document().up = "x"
    assert unpacked(client.get("mesh").content)[0]["axes"][1] == [1, 0, 0] != header["axes"][1]


def _cloud():
    return PointCloud(np.random.default_rng(0).random((300, 3)))


@pytest.mark.parametrize(("make", "name", "kind", "drawn"), [
    (_cloud, "cloud.ply", "points", {"positions", "normals", "areas"}),
    (lambda: shapes.squares(6), "quads.ply", "polygons",
     {"positions", "triangles", "sources", "areas"}),
    (lambda: shapes.column(1), "cube.vtu", "tets", {"positions", "triangles", "sources", "areas"}),
])  # fmt: skip
def test_all_kinds_of_cells_are_shown_painted_and_split(serve, tmp_path, make, name, kind, drawn):
    cells = make()
    write_mesh(tmp_path / name, cells)
    client = serve(tmp_path / name, n_segments=2)
    header, arrays = unpacked(client.get("mesh").content)
    assert (header["kind"], set(arrays)) == (kind, drawn)
    if "sources" in arrays:
        assert set(arrays["sources"].tolist()) <= set(range(header["n_cells"]))
    labels, revision = client.labels(), client.state()["revision"]
    assert np.array_equal(labels, superfacets.segment(superfacets.read_mesh(tmp_path / name)
                          if kind != "points" else superfacets.read_cloud(tmp_path / name),
                          2).labels)  # fmt: skip
    painted = client.done("paint", **{"class": 1}, cells=encoded(np.flatnonzero(labels == 1)))
    assert painted["changed"] == np.count_nonzero(labels == 1)
    assert np.array_equal(client.classes() == 1, labels == 1)
    first, last = np.flatnonzero(labels == 0)[[0, -1]].tolist()
    split = client.done("split", region=0, revision=revision, red=[first], blue=[last])
    assert last in decoded(split["cells"])
    for what, formats in client.state()["exports"].items():
        for format in formats:
            if format not in ("las", "laz", "vtp", "vtu", "vtk"):
                assert client.get("export", what=what, format=format).status_code == 200
    _, regions = unpacked(client.get("regions", revision=split["revision"]).content)
    assert regions["arcs"].max() == 2
    _, borders = unpacked(client.get("borders", revision=split["revision"]).content)
    assert bool(borders) == (kind == "polygons")


def test_a_region_is_divided_into_parts_in_one_step(client, serve, sheet):
    before, revision = client.labels(), client.state()["revision"]
    found = client.done("refine", region=7, revision=revision, parts=3)
    assert (found["seq"], found["n_regions"]) == (1, 22)
    after = client.labels()
    assert set(after[before == 7]) == {7, 20, 21}
    np.testing.assert_array_equal(after[before != 7], before[before != 7])
    answer = client.post("refine", region=7, revision=client.state()["revision"], parts=9999)
    assert "parts must be at most" in answer.json()["error"]
    client.files.close()
    assert np.array_equal(client.labels(), after)
    client.done("undo")
    assert np.array_equal(client.labels(), before)


def test_new_work_has_the_parameters_of_the_command(serve, tmp_path):
    mesh = shapes.bumpy_sheet(24)
    red = mesh.vertices[mesh.faces[:, 0], 0] > 0.5
    colors = np.where(red[:, None], [255, 0, 0], [0, 0, 255])
    write_mesh(tmp_path / "red.ply", mesh, colors=colors.astype(np.uint8))
    client = serve(tmp_path / "red.ply", n_segments=None)
    client.files.parameters = {"radius": 0.2, "scans": True, "color": True}
    found = client.state()["parameters"]
    count = round(client.document().areas.sum() / (np.pi * 0.2**2))
    assert (found["n_segments"], found["alpha"]) == (count, superfacets.SCANS["alpha"])
    labels = client.labels()
    assert not set(labels[red]) & set(labels[~red])


def test_neighboring_regions_are_joined_by_arcs(client):
    state = client.state()
    header, arrays = unpacked(client.get("regions", revision=state["revision"]).content)
    assert (header["n_regions"], set(arrays)) == (20, {"arcs"})
    assert (arrays["arcs"][:, 0] < arrays["arcs"][:, 1]).all()
    assert set(arrays["arcs"].ravel().tolist()) == set(range(20))


def test_parts_of_faces_beyond_smooth_borders_are_shown_as_a_face_of_the_other_region(
    client, sheet
):
    revision, labels = client.state()["revision"], client.labels()
    with client.document().lock:  # of this thread, while another answers
        _, arrays = unpacked(client.get("borders", revision=revision).content)
    cut = superfacets.cut_borders(superfacets.read_mesh(sheet), labels)
    is_part = cut.labels != labels[cut.sources]
    assert np.array_equal(arrays["sources"], cut.sources[is_part])
    assert np.array_equal(labels[arrays["shown"]], cut.labels[is_part])
    header, _ = unpacked(client.get("mesh").content)
    corners = arrays["positions"][arrays["triangles"]]
    assert np.allclose(corners + header["center"], cut.mesh.vertices[cut.mesh.faces[is_part]])


def test_cells_in_any_order_are_painted_and_undone(client):
    labels = client.labels()
    cells = np.flatnonzero(np.isin(labels, [3, 5]))
    answer = client.done("paint", **{"class": 2}, cells=encoded([*cells[::-1], cells[0]]))
    assert answer["changed"] == np.isin(labels, [3, 5]).sum()
    assert (answer["seq"], answer["can_undo"], answer["can_redo"]) == (1, True, False)
    assert np.array_equal(client.classes(), 2 * np.isin(labels, [3, 5]))
    some = np.flatnonzero(labels == 3)[:4]
    client.done("paint", **{"class": 0}, cells=encoded(some))
    back = client.done("undo")
    assert np.array_equal(decoded(back["cells"]), some)
    assert decoded(back["paint"]).tolist() == [2] * 4
    assert decoded(client.done("redo")["paint"]).tolist() == [0] * 4
    client.done("undo")
    client.done("undo")
    answer = client.post("undo")
    assert (answer.status_code, answer.json()["error"]) == (409, "there is nothing to undo")
    assert not client.classes().any()


@pytest.mark.parametrize(("name", "body", "status", "message"), [
    ("paint", {"class": True, "cells": ""}, 400, "class must be a whole number"),
    ("paint", {"class": 1, "cells": "?"}, 400, "cells must be base64"),
    ("paint", {"class": 9, "cells": encoded([1])}, 400, "there is no class 9"),
    ("paint", {"class": 1, "cells": "", "stroke": 7}, 400, "stroke must be a string"),
    ("paint", {"class": 1, "cells": "", "part": "7"}, 400, "part must be a whole number"),
    ("split", {"red": [0], "blue": [1], "revision": 0, "region": "x"}, 400, "whole number"),
    ("split", {"red": [0], "blue": [-1], "region": 0}, 400,
     "blue contains a cell that does not exist: the mesh has 1152 cells"),
    ("split", {"red": [1 << 64], "blue": [1], "region": 0}, 400,
     "which does not fit into 64 bits"),
    ("paint", {"class": 10**400, "cells": ""}, 400, "which does not fit into 64 bits"),
    ("split", {"red": "x", "blue": [1], "region": 0}, 400, "red must be a list of numbers"),
    ("split", {"red": [0], "blue": [1], "region": 0, "revision": 1}, 410,
     "revision 1 no longer exists"),
    ("similar", {"revision": "a"}, 410, "revision a no longer exists"),
    ("similar", {"revision": "a" * 9999}, 410, f"revision {'a' * 197}... no longer exists"),
    ("classes", {"classes": 3}, 400, "classes must be a list"),
    ("segment", {"n_segments": 0}, 400, "n_segments must be at least 1"),
    ("segment", {"n_segments": 2.5}, 400, "n_segments must be an integer"),
    ("segment", {"n_segments": 5000}, 400,
     "n_segments must be at most 1152, the number of cells, got 5000"),
    ("segment", {"level": 21}, 400,
     "level must be at most 20, the number of regions on the finest level, got 21"),
    ("segment", {"beta": 1}, 400, "unknown parameter beta"),
    ("segment", {"alpha": -1}, 400, "alpha must be finite and not negative"),
    ("export", {"what": "all"}, 400, "what must be one of cells, objects"),
    ("export", {"what": "cells", "format": "exe"}, 400, "format must be one of npy"),
    ("import", {"files": {}}, 400, "files must be a list of objects"),
    ("settle", {"accept": 3}, 400, "accept must be a list of pairs"),
    ("settle", {"accept": [[1]]}, 400, "accept must be a list of pairs"),
    ("settle", {"accept": [[1, "a"]]}, 400, "class must be a whole number"),
    ("settle", {"reject": [7]}, 400, "suggestion 7 does not exist"),
])  # fmt: skip
def test_wrong_requests_say_what_is_wrong(client, name, body, status, message):
    before = client.state()
    answer = client.post(name, **body)
    assert answer.status_code == status
    assert message in answer.json()["error"]
    assert client.state() == before


def test_what_is_no_json_object(client):
    for content, message in (
        (b"{", "is not valid JSON"), (b"[1]", "is not a JSON object"),
        (b"[" * 100_000, "is nested too deeply"), (b'{"a":' * 100_000, "is nested too deeply"),
        (b'{"alpha":NaN}', "has the number NaN"), (b'{"stroke":"\xff"}', "is not valid JSON"),
        (b'{"class":' + b"1" * 5000 + b"}", "does not fit into 64 bits"),
        (b'{"stroke":"\\udc00"}', "contains text that is not valid Unicode"),
    ):  # fmt: skip
        answer = client.http.post("/api/files/0/paint", content=content)
        assert (answer.status_code, message in answer.json()["error"]) == (400, True)
        answer = client.http.post("/api/files/0/segment", content=content)
        assert answer.status_code == 400


def test_files_and_routes_that_are_not_there(client):
    error = "file 1 does not exist: the studio has 1 file"
    assert client.get("state", 1).json() == {"error": error}
    assert client.get("dance").json() == {"error": "unknown route: GET /api/files/0/dance"}
    assert client.get("split").status_code == 405
    assert client.get("labels", revision="x").status_code == 400
    assert client.get("labels", revision="1" * 5000).status_code == 400
    assert client.get("state", "1" * 5000).json() == {"error": "the path is too long"}
    assert client.get("state", "1" * 100).status_code == 404


def test_a_run_tells_its_progress_and_ends_with_a_revision(client):
    before = client.state()
    lines = client.segment(n_segments=12)
    assert {"stage": "seeding"} in lines
    assert any("iteration" in line for line in lines)
    assert lines[-1]["n_regions"] == 12
    state = client.state()
    assert state["revision"] == lines[-1]["revision"] != before["revision"]
    assert (state["parameters"]["n_segments"], state["seq"]) == (12, 1)
    assert client.segment(level=5)[-1]["n_regions"] == 5
    assert client.labels().max() == 4
    assert client.segment(n_segments=13)[-1]["parameters"]["level"] is None
    assert client.segment(alpha=3)[-1]["n_regions"] == 13


def test_a_preview_leaves_the_state(client):
    before = client.state()
    preview = client.segment(n_segments=9, preview=True)[-1]
    assert client.state() == before
    assert client.segment(n_segments=9)[-1]["revision"] == preview["revision"]


def test_as_many_revisions_as_promised_are_kept(client):
    first = client.state()["revision"]
    for n in range(2, 1 + MAX_KEPT):
        client.segment(n_segments=n)
    assert client.get("labels", revision=first).status_code == 200  # now the newest
    for n in range(1 + MAX_KEPT, 2 + 2 * MAX_KEPT):
        client.segment(n_segments=n)
    answer = client.get("labels", revision=first)
    assert answer.status_code == 410
    assert f"revision {first} no longer exists" in answer.json()["error"]


def test_a_newer_run_cancels_the_one_before(client, monkeypatch):
    document = client.document()
    parameters = document.state.partition.parameters
    outcomes = []
    real = segmenting.segment

    def slow(cells, n_segments, **options):
        for number in range(1000):
            if number == 1 and len(outcomes) == 0:
                outcomes.append("begun")
            options["callback"]("classify", number, 1)
            if len(outcomes) > 1 or n_segments == 8:
                break
            time.sleep(0.01)
        return real(cells, n_segments, **options)

    monkeypatch.setattr(segmenting, "segment", slow)

    async def both():
        options = {"base_url": f"http://127.0.0.1:{PORT}", "headers": {"X-Token": TOKEN}}
        async with httpx.AsyncClient(transport=client.http._transport, **options) as http:
            first = asyncio.ensure_future(http.post("/api/files/0/segment", json={"n_segments": 7}))
            while not outcomes and not first.done():
                await asyncio.sleep(0.01)
            second = await http.post("/api/files/0/segment", json={"n_segments": 8})
            return [await first, second]

    first, second = (json.loads(answer.text.splitlines()[-1]) for answer in asyncio.run(both()))
    assert first == {"cancelled": True}
    assert second["n_regions"] == 8
    assert document.state.partition.parameters == {**parameters, "n_segments": 8}


def test_an_error_in_a_run_is_its_last_line(client):
    document = client.document()
    document.journal.close()
    assert "the work file is closed" in client.segment(n_segments=6)[-1]["error"]
    assert client.state()["n_regions"] == 20


def test_regions_that_face_the_same_way_are_similar_to_a_flat_region(serve, tmp_path):
    """The regions of the floor of a box have shapes like the regions of its walls."""
    write_mesh(tmp_path / "box.ply", superfacets.subdivide(shapes.cube(), max_edge=0.1).mesh)
    client = serve(tmp_path / "box.ply", n_segments=60)
    graph = superfacets.region_graph(client.document().cells, client.labels())
    floor = np.flatnonzero(graph.normals[:, 2] < -0.9)
    body = {"region": int(floor[0]), "revision": client.state()["revision"]}
    for tolerance, expected in ((0.05, floor), (0.6, np.flatnonzero(graph.normals[:, 2] < 0.9))):
        assert client.done("similar", **body, tolerance=tolerance)["regions"] == expected.tolist()
    assert len(client.done("similar", **body, tolerance=1)["regions"]) == graph.n_regions


def test_an_object_on_a_floor_is_not_similar_to_the_floor():
    """The mean normal of an object points up too, because the object has no bottom."""
    xs, ys = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    vertices = np.column_stack([xs.ravel(), ys.ravel(), np.zeros(25)])
    corner = 5 * np.arange(4)[:, None] + np.arange(4)
    floor = np.stack([corner, corner + 5, corner + 6, corner + 1], axis=-1).reshape(-1, 4)
    box = [[6, 11, 26, 25], [11, 12, 27, 26], [12, 7, 28, 27], [7, 6, 25, 28], [25, 26, 27, 28]]
    top = vertices[[6, 11, 12, 7]] + [0.0, 0.0, 1.0]
    faces = np.vstack([np.delete(floor, 5, axis=0), box])  # the box stands on a hole in the floor
    mesh = PolygonMesh.of_faces(np.vstack([vertices, top]), faces)
    labels = np.repeat([0, 1, 2], [7, 8, 5])  # two regions of the floor, and the box
    graph = superfacets.region_graph(mesh, labels)
    assert graph.normals[2].tolist() == [0.0, 0.0, 1.0]
    for tolerance in (0.0, 0.05, 1.0):
        assert similar_regions(graph, 0, tolerance) == [0, 1]


@pytest.mark.parametrize(("height", "found"), [(0.05, [0, 1, 2, 3]), (0.5, [0, 1, 3])])
def test_a_board_on_a_floor_is_not_similar_to_the_floor(height, found):
    """Region 2 lies higher than 0 and 1, behind a slope; region 3 is another floor."""
    xs = np.array([0, 1, 2, 3, 3.2, 7, 9, 10])
    zs = np.array([0, 0, 0, 0, height, height, 0, 0])
    vertices = np.array([[x, y, z] for x, z in zip(xs, zs, strict=True) for y in (0, 2)])
    strips = [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in (0, 1, 2, 3, 4, 6)]
    labels = [0, 1, 1, 2, 2, 3]  # the slope belongs to the board
    graph = superfacets.region_graph(PolygonMesh.of_faces(vertices, strips), labels)
    assert similar_regions(graph, 0, 0.09) == found
    assert similar_regions(graph, 0, 0.5) == [0, 1, 2, 3]


def test_similar_regions_are_found(serve, tmp_path):
    write_mesh(tmp_path / "bear.ply", superfacets.sample_mesh(5_000))
    client = serve(tmp_path / "bear.ply", n_segments=20)
    revision = client.state()["revision"]
    lengths = superfacets.region_graph(client.document().cells, client.labels()).normal_lengths
    body = {"region": int(lengths.argmin()), "revision": revision}
    assert lengths.min() < 0.5  # compared by shape, not by direction
    one = client.done("similar", **body, tolerance=0)["regions"]
    some = client.done("similar", **body, tolerance=0.5)["regions"]
    every = client.done("similar", **body, tolerance=1)["regions"]
    assert one == [body["region"]]
    assert set(one) < set(some) < set(every) == set(range(len(lengths)))
    assert client.post("similar", region=20, revision=revision).status_code == 400
    assert client.post("similar", region=1, revision=revision, tolerance=2).status_code == 400


def test_classes_are_kept(client):
    classes = [{"id": 1, "name": "roof", "color": "#ff0000", "key": "r"}, {"id": 7, "name": "wall"}]
    answer = client.done("classes", classes=classes)
    assert answer["classes"][0] == classes[0]
    assert client.state()["classes"] == answer["classes"]
    assert client.done("undo")["kind"] == "classes"
    assert len(client.state()["classes"]) == 6


def test_the_server_is_asked_to_end(client):
    assert client.http.post("/api/quit").json() == {"quits": True}
    assert client.quits == 1


def test_a_full_disk_is_told_and_leaves_the_state(client, monkeypatch, broken):
    before = client.state()
    broken("os.fsync", OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    answer = client.post("paint", **{"class": 1}, cells=encoded([1]))
    monkeypatch.undo()
    assert answer.status_code == 507
    assert "No space left on device: the operation was not done" in answer.json()["error"]
    assert client.state() == before
    assert not client.classes().any()


def test_a_changed_input_is_told(client, sheet):
    client.state()
    sheet.write_bytes(sheet.read_bytes() + b" ")
    answer = client.post("paint", **{"class": 1}, cells=encoded([1]))
    assert answer.status_code == 409
    assert "sheet.ply has changed since the studio read it" in answer.json()["error"]


def test_errors_of_the_machine_are_one_line():
    assert message_of(MemoryError()) == "not enough memory"
    assert message_of(OSError(2, "No such file", "a.ply")) == "a.ply: No such file"
    assert message_of(ValueError("two\nlines")) == "two lines"


def stand_in(monkeypatch, code):
    """Draw thumbnails by this code instead, which gets the path of the picture in sys.argv[2]."""
    calls = []
    run = Thumbnails._run

    def run_code(self, command):
        calls.append(command)
        return run(self, [sys.executable, "-c", code, *command[-2:]])

    monkeypatch.setattr(Thumbnails, "_run", run_code)
    return calls


def test_thumbnails_are_pictures_or_not_there(client, monkeypatch, tmp_path):
    code = f"""
import pathlib, sys
flag = pathlib.Path({str(tmp_path / "flag")!r})
if not flag.exists():
    flag.touch()
    sys.exit("no\\nRenderError: no GL")
pathlib.Path(sys.argv[2]).write_bytes(b"PNG")
"""
    calls = stand_in(monkeypatch, code)
    answer = client.get("thumbnail")
    assert (answer.status_code, answer.json()["error"]) == (501, "RenderError: no GL")
    for _ in range(2):
        answer = client.get("thumbnail")
        assert (answer.status_code, answer.content) == (200, b"PNG")
        assert answer.headers["content-type"] == "image/png"
    assert len(calls) == 2


def test_a_thumbnail_that_takes_too_long_is_given_up(sheet, monkeypatch, limit):
    stand_in(monkeypatch, "import time; time.sleep(60)")
    limit("time for a thumbnail", 0.5)
    with pytest.raises(RenderError, match=r"drawing took more than 0\.5 seconds"):
        Thumbnails().png(sheet)


def test_a_studio_that_ends_waits_for_no_thumbnail(sheet, monkeypatch):
    stand_in(monkeypatch, "import time; time.sleep(60)")
    pictures = Thumbnails()
    begin = time.monotonic()
    timer = threading.Timer(0.5, pictures.close)
    timer.start()
    for _ in range(2):  # the running one, and one that is requested later
        with pytest.raises(RenderError, match="drawing failed with status -9"):
            pictures.png(sheet)
    assert time.monotonic() - begin < 30
    timer.join()


def test_a_thumbnail_is_drawn_by_a_process_of_its_own(sheet):
    pytest.importorskip("vtkmodules")
    try:
        ensure_gl()
    except RenderError as error:
        pytest.skip(str(error))
    pictures = [Thumbnails().png(sheet, up) for up in ("auto", "x")]
    assert [one[:4] for one in pictures] == [b"\x89PNG"] * 2
    assert pictures[0] != pictures[1]
    sheet.write_text("no mesh")
    with pytest.raises(RenderError, match="not a PLY file"):
        Thumbnails().png(sheet)


def test_the_state_names_the_work_file_with_its_folder(serve, sheet, monkeypatch):
    monkeypatch.chdir(sheet.parent)  # the browser has one storage for files of all folders
    assert serve(Path(sheet.name)).state()["work"] == f"{sheet.resolve()}.studio.jsonl"


def test_a_thumbnail_runs_no_code_of_the_current_folder(sheet, tmp_path, monkeypatch):
    (tmp_path / "superfacets.py").write_text("open('PWNED', 'w')")
    monkeypatch.chdir(tmp_path)
    with contextlib.suppress(RenderError):  # without VTK there is no picture
        Thumbnails().png(sheet)
    assert not (tmp_path / "PWNED").exists()
