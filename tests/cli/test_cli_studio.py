"""The command `studio`."""

import json
import os
import socket
import sys
import time
import urllib.parse
import urllib.request
from pathlib import Path

import numpy as np
import pytest
import shapes

pytest.importorskip("uvicorn")

from superfacets import Mesh, MeshError, read_labels, read_mesh, segment, write_mesh
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.files import Files
from superfacets_studio.export.write import export_bytes
from superfacets_studio.labels.classes import checked_class_list, default_classes, write_classes
from superfacets_studio.web.address import Address, address_file, keep, open_again, open_socket

HOST = ("127.0.0.1", 0)  # any free port


def seen(address):
    """Return the address that a browser opens, its file, the content, and rights of other users."""
    path = Path(urllib.request.url2pathname(urllib.parse.urlsplit(address).path))
    return address, path, path.read_text(), path.stat().st_mode & 0o77


@pytest.fixture
def served(monkeypatch):
    """Record the arguments instead of serving."""
    calls = []

    def serve(files, opened, address, on_start):
        calls.append((files, opened.getsockname()))
        on_start("http://127.0.0.1:1/?token=t")

    monkeypatch.setattr("superfacets_studio.serve", serve)
    monkeypatch.setattr("webbrowser.open", lambda address: calls.append(seen(address)))
    yield calls
    for files, _ in calls[:1]:
        files.close()


def test_the_address_is_printed_and_opened(run, sheet, served):
    status, out, err = run("studio", sheet)
    assert (status, err) == (0, "")
    assert out == "superfacets studio: http://127.0.0.1:1/?token=t (press Ctrl-C to stop)\n"
    assert served[0][1][0] == "127.0.0.1"
    address, path, text, mode = served[1]
    assert address.startswith("file:///")
    assert "token" not in address
    assert '<meta http-equiv="refresh" content="0; url=http://127.0.0.1:1/?token=t">' in text
    assert mode == 0 or os.name == "nt"
    assert not path.exists()


def test_options_are_handed_on(run, sheet, served, tmp_path):
    (tmp_path / "names.txt").write_text("roof\nwall\n")
    work = tmp_path / "elsewhere.jsonl"
    status, _, _ = run("studio", sheet, "--no-browser", "-n", 9, "--work", work, "--up", "z",
                       "--classes", tmp_path / "names.txt")  # fmt: skip
    with served[0][0].document(0) as document:
        assert (status, len(served), document.journal.path) == (0, 1, work)
        assert (document.revision.n_regions, document.up) == (9, "z")
        assert [entry["name"] for entry in document.class_list] == ["roof", "wall"]
    assert "(a.npy): import labels in the browser" in run("studio", sheet, "a.npy")[2]


def test_a_port_in_use_is_an_error(run, sheet, served):
    with socket.create_server(HOST) as other:
        port = other.getsockname()[1]
        status, out, err = run("studio", sheet, "--port", port)
    assert (status, out, served) == (1, "", [])
    assert f"port {port} is in use: choose another with --port, or omit --port" in err


def test_a_port_that_may_not_be_opened_is_an_error(broken):
    broken("socket.socket.bind", PermissionError(13, "Permission denied"))
    with pytest.raises(OSError, match=r"^cannot listen on port 80: Permission denied$"):
        open_socket(80)


def test_a_torn_work_file_is_noted(run, sheet, served):
    run("studio", sheet, "--no-browser")
    served[0][0].close()
    work = sheet.with_name("sheet.ply.studio.jsonl")
    work.write_bytes(work.read_bytes() + b'{"seq":1')
    status, _, err = run("studio", sheet, "--no-browser")
    assert status == 0
    assert "note:" in err
    assert "was left out" in err
    served[1][0].close()


def test_the_extra_is_asked_for(run, sheet, monkeypatch):
    monkeypatch.setitem(sys.modules, "starlette", None)
    status, _, err = run("studio", sheet)
    assert status == 1
    assert "pip install 'superfacets[studio]'" in err


def test_a_mesh_that_cannot_be_read_is_an_error(run, tmp_path, served):
    (tmp_path / "a.ply").write_text("no")
    status, _, err = run("studio", tmp_path / "a.ply")
    assert (status, served) == (1, [])
    assert "a.ply" in err
    assert not (tmp_path / "a.ply.studio.jsonl").exists()


def test_servers_have_the_same_ports_again(run, sheet, served, monkeypatch):
    def used():
        run("studio", sheet, "--no-browser")
        served[-1][0].close()
        return served[-1][1][1]

    with socket.create_server(HOST) as one, socket.create_server(HOST) as other:
        ports = [one.getsockname()[1], other.getsockname()[1]]
    monkeypatch.setattr("superfacets_studio.web.address.PORTS", ports)
    assert [used(), used()] == [ports[0]] * 2
    with socket.create_server(("127.0.0.1", ports[0])):
        assert used() == ports[1]
        with socket.create_server(("127.0.0.1", ports[1])):
            assert used() not in ports


def test_the_address_of_a_server_that_was_killed_is_taken_again(run, sheet, served):
    with socket.create_server(HOST) as free:
        kept = Address(free.getsockname()[1], "a-token-of-the-tests")
    for port in (None, kept.port):
        opened, address = open_again(port, kept)
        opened.close()
        assert address == kept
    with socket.create_server(("127.0.0.1", kept.port)):
        opened, address = open_again(None, kept)
        opened.close()
        assert address.port != kept.port
        assert address.token != kept.token
    with keep(address_file(sheet.with_name("sheet.ply.studio.jsonl")), kept):
        run("studio", sheet, "--no-browser")
    assert served[0][1][1] == kept.port


def test_a_list_says_how_far_the_work_is_and_what_is_reviewed(run, sheet, served, monkeypatch):
    document = Document.open(Path(sheet))
    document.paint(np.arange(document.n_cells, dtype=np.uint32), 1)
    document.review(True)
    document.close()
    status, out, err = run("studio", sheet, "--list")
    assert (status, out, err) == (0, f"100.0 %  {sheet.name}  reviewed  < 1 min, 1 stroke\n", "")
    document = Document.open(Path(sheet))
    now = time.time()
    monkeypatch.setattr("time.time", lambda: now + 50)
    document.paint(np.arange(3, dtype=np.uint32), 2)
    document.undo()
    monkeypatch.setattr("time.time", lambda: now + 100)
    document.redo()
    document.close()
    _, out, _ = run("studio", sheet, "--list")
    assert out == f"100.0 %  {sheet.name}  changed since review  1 min, 2 strokes\n"
    assert not served


def test_classes_other_than_the_stored_ones_are_refused(run, sheet, served, tmp_path):
    scans, names = tmp_path / "scans", tmp_path / "names.txt"
    scans.mkdir()
    sheet.rename(scans / "sheet.ply")
    names.write_text("roof\nwall\n")
    arguments = ("studio", scans, "--classes", names)
    assert run(*arguments, "--no-browser")[0] == 0
    with served[0][0].document(0):
        pass
    stored = scans / "superfacets-classes.json"
    own = {"id": 9, "name": "door", "color": "#112233", "key": "1"}  # added in the studio
    stored.write_text(json.dumps([*json.loads(stored.read_text()), own]))
    content = stored.read_bytes()
    assert run(*arguments, "--list")[::2] == (0, "")
    names.write_text("roof\ndoor\n")
    status, out, err = run(*arguments, "--no-browser")
    assert (status, out) == (2, "")
    assert f"error: {stored} stores other classes than {names}: omit --classes" in err
    assert err.count("\n") == 1
    assert (len(served), stored.read_bytes()) == (1, content)


def test_classes_that_old_work_does_not_use_are_noted(run, labeled, served, tmp_path):
    (tmp_path / "names.txt").write_text("roof\n")
    labeled.close()
    arguments = ("studio", labeled.path, "--no-browser", "--classes", tmp_path / "names.txt")
    status, _, err = run(*arguments)
    assert status == 0
    assert "note: the work has other classes than --classes, which is for new work" in err


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_agree_refuses_a_folder_with_a_file(run, labeled, tmp_path, wrong):
    arguments = [labeled.path, labeled.journal.path, labeled.journal.path]
    arguments[wrong] = tmp_path
    status, out, err = run("agree", *arguments)
    assert (status, out) == (2, "")
    assert f"{labeled.journal.path} is no folder: MINE and THEIRS must be two files or" in err
    assert err.count("\n") == 1


@pytest.fixture
def teams(tmp_path, monkeypatch):
    """Make folders of meshes of 128 equal faces, with the work of two people."""
    mine = [("chair", 0, 32), ("table", 32, 64)], [("chair", 0, 1)], [("table", 0, 96)]
    theirs = [("Table", 16, 64), ("Chair", 0, 16)], [], [("Table", 0, 32), ("lamp", 32, 40)]
    for who, works in (("mine", mine), ("theirs", theirs)):
        names = [*dict.fromkeys(name for work in works for name, _, _ in work)]
        for name in ("a.ply", "b.ply", "sub/c.ply"):
            (tmp_path / who / name).parent.mkdir(parents=True, exist_ok=True)
            write_mesh(tmp_path / who / name, shapes.flat(8))
        files = Files.of(tmp_path / who, None, 8, default_classes(names))
        for number, work in enumerate(works):
            for name, start, end in work:
                with files.document(number) as document:
                    cells = np.arange(start, end, dtype=np.uint32)
                    document.paint(cells, 1 + names.index(name), objects=1)
        files.close()
    monkeypatch.chdir(tmp_path)


def test_agree_compares_two_folders_in_one_table(run, teams):
    work = "a.ply.studio.jsonl"
    status, out, err = run("agree", "mine", "mine", "theirs", "-o", "merged/new")
    note = "superfacets: note: theirs: has no work file of b.ply: copied from mine\n"
    assert (status, err) == (0, note)
    assert out.splitlines() == [
        "file       both labeled  agree there  mean IoU of classes  mean IoU of objects",
        "a.ply      50.0 %        75.0 %       0.583                0.583",
        "sub/c.ply  31.2 %        80.0 %       0.400                0.400",
        "all 2      40.6 %        76.9 %       0.409                0.492", "wrote merged/new",
    ]  # fmt: skip
    stored = Path("merged", "new", "superfacets-classes.json")
    assert [one["name"] for one in json.loads(stored.read_text())] == ["chair", "table", "lamp"]
    assert (Path("merged/new", work).is_file(), len([*stored.parent.rglob("*")])) == (True, 5)
    Path("merged/new", work).unlink()
    status, out, err = run("agree", "mine", "mine", "theirs", "-o", "merged/new")
    assert (status, out, "c.ply.studio.jsonl exists already" in err) == (1, "", True)
    assert not Path("merged/new", work).exists()
    Path("theirs/superfacets-classes.json").unlink()  # the work files list the classes, too
    found = json.loads(run("agree", "mine/a.ply", "mine", "theirs", "--json")[1])
    assert (found["files"][0]["file"], found["missing"]) == ("a.ply", {"mine": [], "theirs": []})
    ious = {row["name"]: row["iou"] for row in found["all"]["classes"]}
    assert ious == {"chair": 0.5, "table": 0.666667}
    status, out, err = run("agree", "mine", "mine", "merged")
    assert (status, out) == (1, "")
    assert err.startswith(
        "superfacets: error: mine: no mesh has two work files, such as mine/a.ply"
    )


def test_agree_keeps_work_that_only_one_person_has(run, teams):
    for first, second, chair in (("mine", "theirs", 1), ("theirs", "mine", 2)):
        status, _, err = run("agree", "mine", first, second, "-o", first + "s", "--prefer=theirs")
        assert (status, err.endswith("has no work file of b.ply: copied from mine\n")) == (0, True)
        merged = Document.read(Path("mine/b.ply"), Path(first + "s", "b.ply.studio.jsonl"))
        assert merged.instances[:2].tolist() == [1000 * chair + 1, 0]
        assert merged.name_of(chair).casefold() == "chair"
    Path("mine/superfacets-classes.json").unlink()  # the work files list the classes, too
    run("agree", "mine", "mine", "theirs", "-o", "named")
    stored = json.loads(Path("named/superfacets-classes.json").read_text())
    assert [one["name"] for one in stored] == ["chair", "table", "lamp"]
    Path("new").mkdir()
    assert run("agree", "mine/b.ply", "new", "mine", "-o", "all")[1].startswith("file   both")
    works = [Path(one, "b.ply.studio.jsonl").read_bytes() for one in ("mine", "all")]
    assert [work.splitlines()[1:] for work in works] == [works[0].splitlines()[1:]] * 2


@pytest.fixture
def labeled(sheet):
    """The file with 20 regions, of which one is chair 1; a studio still has it open."""
    document = Document.open(Path(sheet), n_segments=20)
    document.set_classes([{"id": 3, "name": "chair", "color": "#0a0b0c"}])
    document.paint(document.revision.cells_of(4), 3, objects=1)
    yield document
    document.close()


def test_exports_are_written_while_a_studio_has_the_work_open(run, labeled, tmp_path):
    work = labeled.journal.path.read_bytes()
    status, out, err = run(
        "studio", labeled.path, "-o", tmp_path / "out" / "deep",
        *("--export", "classes", "--export", "vertex-classes.txt", "--export", "instances"),
        *("--export", "objects", "--export", "objects.npz", "--export", "superfacets"),
        *("--export", "region-classes"),
    )  # fmt: skip
    assert (status, err) == (0, "")
    kinds = (
        ("cells", "npy"), ("vertices", "txt"), ("instances", "txt"), ("objects", "json"),
        ("objects", "npz"), ("regions", "npy"), ("region_classes", "csv"),
    )  # fmt: skip
    for line, (what, format) in zip(out.splitlines(), kinds, strict=True):
        name, content = export_bytes(labeled, what, format)
        assert line == f"wrote {tmp_path / 'out' / 'deep' / name}"
        assert (tmp_path / "out" / "deep" / name).read_bytes() == content
    assert labeled.journal.path.read_bytes() == work


def test_a_folder_is_exported_except_files_that_fail(run, tmp_path):
    scans, out = tmp_path / "scans", tmp_path / "out"
    (scans / "b").mkdir(parents=True)
    for name in ("a.ply", "b/a.ply", "c.ply", "new.ply", "twin.ply", "twin.off"):
        write_mesh(scans / name, shapes.bumpy_sheet(8))
    shared = checked_class_list([{"id": 1, "name": "leg"}])
    write_classes(scans / "superfacets-classes.json", shared)
    for name in ("a.ply", "b/a.ply", "c.ply", "twin.ply", "twin.off"):
        document = Document.open(scans / name, None, 5, shared, lambda _: None)
        document.paint(np.arange(9, dtype=np.uint32), 1, objects=2)
        document.close()
    (scans / "c.ply.studio.jsonl").write_text("no\n")
    write_mesh(scans / "bare.ply", shapes.bumpy_sheet(8))
    (scans / "bare.ply.studio.jsonl").touch()  # as left by a process killed at the start
    Document.open(scans / "new.ply", None, 5, shared, lambda _: None).close()  # labels nothing
    status, printed, err = run("studio", scans, "--export", "objects", "-o", out)
    assert status == 1
    assert "c.ply.studio.jsonl: is not a work file" in err
    assert "note: exports 6 of 7 files: no work file of bare.ply\n" in err
    assert err.count("inputs that differ only in the ending have the same exports") == 2
    assert err.count("export one input at a time, each to another folder with -o") == 2
    assert "3 of 6 files failed" in err
    assert f"note: {scans / 'new.ply'}: no labels are exported, because nothing is labeled\n" in err
    written = sorted(path for path in out.rglob("*") if path.is_file())
    assert written == [out / "a.objects.json", out / "b" / "a.objects.json"]
    assert len(printed.splitlines()) == 2
    assert '"name":"leg","color":[230,159,0]' in written[0].read_text()
    run("studio", scans, "--export", "objects", "--export", "superfacets", "-o", tmp_path)
    assert [path.name for path in tmp_path.glob("new*")] == ["new.superfacets.npy"]


def test_wrong_exports_write_nothing(run, sheet, labeled, tmp_path):
    work = f"{sheet}.studio.jsonl"
    for arguments, exit_status, message in (
        (("--export", "faces"), 2, "--export must be one of classes, vertex-classes"),
        (("--export", "objects.ply"), 2, "format must be one of json, npz"),
        (("-o", tmp_path / "out"), 2, "say what to export with --export"),
        (("--list", "--export", "objects"), 2, "--list and --export exclude each other"),
        (("--export", "objects", "--work", tmp_path / "no.jsonl"), 1, "there is no work file"),
    ):
        status, out, err = run("studio", sheet, *arguments)
        assert (status, out) == (exit_status, "")
        assert message in err
        assert err.count("\n") == 1
    torn = Path(work).read_bytes().replace(b'"op"', b'"oq"', 1)
    (tmp_path / "torn.jsonl").write_bytes(torn)
    options = ("--work", tmp_path / "torn.jsonl", "-o", tmp_path / "out")
    status, _, err = run("studio", sheet, "--export", "classes", *options)
    assert status == 1
    assert "torn.jsonl: line 2 of the work file is damaged" in err
    assert not (tmp_path / "out").exists()


@pytest.fixture
def classes(labeled, tmp_path):
    """Write the classes in the work file to a label file, with -1 for no class; return its path."""
    given = labeled.state.classes.astype(np.int32)
    np.save(tmp_path / "classes.npy", np.where(given > 0, given, -1))
    return tmp_path / "classes.npy"


def test_labels_of_a_command_may_be_a_work_file(run, sheet, labeled, classes, tmp_path):
    work, found = labeled.journal.path, tmp_path / "cells.npy"
    assert run("convert", sheet, work, "-o", found)[::2] == (0, "")
    assert np.array_equal(np.load(found), np.load(classes))
    rows = run("regions", sheet, work)[1].splitlines()
    assert [row.split(",")[-1] for row in rows] == ["name", "chair"]
    for labels in (work, classes):
        picture = tmp_path / f"{labels.name}.png"
        assert run("render", sheet, "--labels", labels, "-o", picture, "--size", "90x90")[0] == 0
    pictures = [(tmp_path / f"{labels.name}.png").read_bytes() for labels in (work, classes)]
    assert pictures[0] == pictures[1]  # unlabeled faces are gray
    np.save(tmp_path / "halves.npy", np.arange(1152) // 576)
    rated = [run("evaluate", sheet, tmp_path / "halves.npy", "--gt", truth)[:2]
             for truth in (work, classes)]  # fmt: skip
    assert rated[0] == rated[1]
    assert rated[0][0] == 0
    assert run("studio", sheet, "--export", "classes")[0] == 0
    exported = ("evaluate", sheet, classes, "--gt", tmp_path / "sheet.classes.npy")
    assert "sheet.classes.npy: 0 counts as a class; if it means no class" in run(*exported)[2]


def test_work_on_another_mesh_is_refused(run, sheet, labeled, tmp_path):
    work, mesh = labeled.journal.path, read_mesh(sheet)
    order = np.random.default_rng(0).permutation(mesh.n_faces)
    other = tmp_path / "other.ply"
    write_mesh(other, Mesh(mesh.vertices, mesh.faces[order]))
    message = "the work file belongs to sheet.ply, not to other.ply: restore the old file, or use"
    for arguments in (
        ("convert", other, work, "-o", tmp_path / "no.npy"),
        ("segment", other, "-n", 5, "--mask", work, "-o", tmp_path / "no.npy"),
    ):
        status, _, err = run(*arguments)
        assert status == 1
        assert err.startswith(f"superfacets: error: {work}: {message}")
        assert err.count("\n") == 1
    assert not (tmp_path / "no.npy").exists()
    other.replace(sheet)
    status, _, err = run("convert", sheet, work, "-o", tmp_path / "no.npy")
    assert status == 1
    assert f"{work}: {sheet} has changed since the work was begun" in err


def test_work_that_was_lost_is_noted(run, sheet, labeled, tmp_path):
    work = tmp_path / "cut.jsonl"
    work.write_bytes(labeled.journal.path.read_bytes()[:-40])
    note = f"note: {work}: the last line was incomplete, as after a crash, and was left out\n"
    for quiet in ((), ("-q",)):
        status, _, err = run("convert", sheet, work, "-o", tmp_path / "cells.npy", *quiet)
        assert (status, err) == (0, f"superfacets: {note}")


@pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")
def test_masks_and_barriers_may_be_work_files(run, sheet, labeled, classes, tmp_path):
    work, given, mesh = labeled.journal.path, np.load(classes), read_mesh(sheet)
    for options, expected in (
        (("--mask", work), {"mask": given > 0}),
        (("--mask", work, "--mask-values", 3), {"mask": given == 3}),
        (("--barriers", work), {"barriers": given}),
    ):
        found = tmp_path / "found.npy"
        assert run("segment", sheet, "-n", 4, *options, "-o", found, "-q")[0] == 0
        assert np.array_equal(np.load(found), segment(mesh, 4, **expected).labels)


def test_read_labels_says_how_to_read_a_work_file(labeled):
    with pytest.raises(
        MeshError,
        match=r"sheet\.ply\.studio\.jsonl: work files of the studio cannot be read without their"
        r" mesh: write the labels with superfacets convert MESH sheet\.ply\.studio\.jsonl -o"
        r" labels\.npy$",
    ):
        read_labels(labeled.journal.path)
