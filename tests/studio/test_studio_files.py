"""A folder of meshes in the studio."""

import base64
import json
import os
import random
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import shapes
from studio_client import encoded

import superfacets
from superfacets import write_mesh
from superfacets_show.colors import color_distances
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.files import MAX_OPEN, Files
from superfacets_studio.documents.journal import JournalError, _coded
from superfacets_studio.labels import classes as labeling
from superfacets_studio.labels.imports import read_import


@pytest.fixture
def folder(tmp_path):
    """Return a folder of five meshes, one of them in a subfolder."""
    (tmp_path / "sub").mkdir()
    for name in ("a.ply", "b.ply", "c.ply", "d.ply", "sub/e.ply"):
        write_mesh(tmp_path / name, shapes.bumpy_sheet(8))
    return tmp_path


def test_all_meshes_are_listed_with_how_far_they_are(serve, folder):
    client = serve(folder)
    listed = client.http.get("/api/files").json()
    assert [entry["name"] for entry in listed] == ["a.ply", "b.ply", "c.ply", "d.ply", "sub/e.ply"]
    assert {entry["done"] for entry in listed} == {0.0}
    client.paint_regions(1, 0, 1, file=1)
    done = client.state(1)["progress"]
    took = {"seconds": pytest.approx(0, abs=60), "strokes": 1}
    expected = {"id": 1, "name": "b.ply", "done": round(done, 6), "n_cells": 128}
    expected |= {"time": pytest.approx(time.time(), abs=60), "statistics": took}
    assert client.http.get("/api/files").json()[1] == expected
    client.close()
    assert serve(folder).http.get("/api/files").json()[1] == expected


def test_only_a_few_are_open_and_others_are_opened_again(serve, folder):
    client = serve(folder)
    for number in range(5):
        client.paint_regions(1, number, file=number)
    assert len(client.files._open) == MAX_OPEN
    for number in range(5):
        assert np.array_equal(client.classes(number) == 1, client.labels(number) == number)


def test_files_that_many_clients_paint_are_never_refused(serve, folder):
    write_mesh(folder / "f.ply", shapes.bumpy_sheet(8))
    client = serve(folder)

    def paint(seed):
        chosen = random.Random(seed)
        for number in chosen.choices(range(6), k=40):
            cell = encoded([chosen.randrange(128)])
            client.done("paint", number, **{"class": chosen.randint(0, 6)}, cells=cell)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(paint, range(8)))
    assert len(client.files._open) == MAX_OPEN


def test_a_document_in_use_stays_open(serve, folder):
    client = serve(folder)
    with client.files.document(0) as used:
        for number in range(1, 5):
            client.state(number)
        assert len(client.files._open) == MAX_OPEN
        used.paint(np.array([1], np.uint32), 1)
    assert client.classes(0)[1] == 1


def test_closing_waits_for_a_document_that_shares_its_classes(serve, folder):
    client = serve(folder)
    with client.files.document(0) as document, ThreadPoolExecutor(1) as pool, document.lock:
        closing = pool.submit(client.files.close)
        while client.files._open:
            time.sleep(0.01)
        document.set_classes([{"id": 1, "name": "one"}])
        assert not closing.done()


def test_classes_are_those_of_the_folder(serve, folder):
    client = serve(folder)
    client.state(1)
    classes = [{"id": 4, "name": "door", "color": "#112233", "key": "d"}]
    client.done("classes", classes=classes)
    assert client.state(1)["classes"] == client.state(2)["classes"] == classes
    assert json.loads((folder / labeling.CLASSES_FILE).read_text()) == classes
    client.close()
    assert serve(folder).state(3)["classes"] == classes


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_given_classes_are_stored_when_a_mesh_is_opened(folder):
    given = labeling.default_classes(["wall", "floor"])
    files = Files.of(folder, None, 8, given)
    assert not (folder / labeling.CLASSES_FILE).exists()  # a list of files changes nothing
    with files.document(0):
        assert labeling.read_classes(folder / labeling.CLASSES_FILE) == given
    files.close()
    assert Files.of(folder, None, 8, ()).classes == given


def test_a_link_in_the_place_of_the_classes_makes_no_file_outside(serve, folder, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside") / "made"
    (folder / labeling.CLASSES_FILE).symlink_to(outside)
    client = serve(folder)
    client.state(1)
    client.done("classes", classes=[{"id": 4, "name": "door", "color": "#112233", "key": "d"}])
    assert labeling.read_classes(folder / labeling.CLASSES_FILE)[0]["name"] == "door"
    assert not outside.exists()


@pytest.mark.skipif(os.name == "nt", reason="no pipes there")
def test_pipes_at_names_of_ours_do_not_stop_the_studio(serve, folder):
    os.mkfifo(folder / labeling.CLASSES_FILE)
    os.mkfifo(folder / "a.ply.studio.jsonl")
    client = serve(folder)
    assert client.http.get("/api/files").json()[0]["done"] == 0
    assert "a.ply.studio.jsonl: is not a regular file" in client.get("state", 0).json()["error"]


def test_a_class_that_another_mesh_has_is_shown_with_it(serve, folder):
    client = serve(folder)
    client.paint_regions(6, 0)
    client.done("classes", 1, classes=[{"id": 1, "name": "one"}])
    assert [entry["id"] for entry in client.state(0)["classes"]] == [1, 6]
    assert [entry["id"] for entry in client.state(1)["classes"]] == [1]
    client.paint_regions(1, 1)


def test_work_goes_on_in_a_folder_and_alone(serve, folder):
    alone = serve(folder / "a.ply")
    alone.done("classes", classes=[{"id": 1, "name": "mine"}, {"id": 2, "name": "yours"}])
    alone.paint_regions(2, 0)
    alone.close()
    client = serve(folder)
    assert [entry["name"] for entry in client.state()["classes"]][:2] == ["class 1", "class 2"]
    client.state(1)
    client.close()
    assert serve(folder / "a.ply").state()["classes"][0]["name"] == "mine"
    assert len(serve(folder / "b.ply").state()["classes"]) == 6


def test_a_work_file_of_a_folder_names_its_classes_without_the_folder(serve, folder, tmp_path):
    client, head = serve(folder), {"id": 7, "name": "Head", "color": "#112233", "key": ""}
    client.done("classes", classes=[head])
    client.paint_regions(7, 0)
    client.done("classes", 1, classes=[head | {"name": "Skull"}])  # is written when both are closed
    client.close()
    moved = (folder / "a.ply.studio.jsonl").rename(tmp_path / "sub" / "alone.jsonl")
    (folder / labeling.CLASSES_FILE).rename(tmp_path / "list")
    lines = moved.read_bytes().splitlines(keepends=True)
    other = Document.open(folder / "a.ply", classes=(head | {"id": 1, "name": "skull"},))
    theirs = Document.read(folder / "a.ply", moved)
    other.paint(np.flatnonzero(theirs.state.classes).astype(np.uint32), 1)
    other.compare("theirs", moved.read_bytes())
    assert (other.agreement()["share"], theirs.name_of(7)) == (1.0, "Skull")
    with pytest.raises(JournalError, match="theirs: has no class list, by which to match"):
        other.compare("theirs", b"".join(lines[:2]))  # as older versions wrote it
    other.close()
    (folder / "a.ply.studio.jsonl").write_bytes(moved.read_bytes())
    client = serve(folder)  # a folder without a list has the classes of its first work file
    client.done("undo")
    assert not client.classes().any()
    assert {client.state(number)["classes"][0]["name"] for number in (0, 1)} == {"Skull"}
    client.close()
    assert (folder / "a.ply.studio.jsonl").read_bytes().startswith(b"".join(lines))
    moved.write_bytes(b"".join(lines[:2]))
    (tmp_path / "list").rename(folder / labeling.CLASSES_FILE)
    assert Document.read(folder / "a.ply", moved).name_of(7) == "Skull"  # from the list above it


def test_results_are_no_inputs(serve, folder):
    client = serve(folder)
    client.done("export", what="cells", format="ply")
    client.done("export", what="regions", format="ply")
    assert len(Files.of(folder, None, None, ()).paths) == 5


def test_a_folder_without_meshes_is_refused(tmp_path, sheet):
    sheet.rename(tmp_path / "sheet.classes.ply")
    with pytest.raises(FileNotFoundError, match="contains only exported files, no mesh to label"):
        Files.of(tmp_path, None, None, ())
    with pytest.raises(ValueError, match="--work is for one file"):
        Files.of(tmp_path, tmp_path / "work", None, ())


def test_one_bad_mesh_stops_no_other(serve, folder):
    (folder / "b.ply").write_text("no mesh")
    client = serve(folder)
    answer = client.get("state", 1)
    assert answer.status_code == 400
    assert "b.ply" in answer.json()["error"]
    assert client.state(2)["n_regions"] == 128
    (folder / "c.ply").unlink()
    client.close()


@pytest.mark.parametrize(("work", "message"), [
    (b"words\n", "line 1 of the work file is damaged"),
    (_coded({"format": "superfacets studio", "n_cells": 9, "done": 1e999}),
     "its progress or number of cells is missing"),
    (_coded({"format": "superfacets studio", "n_cells": "9", "done": 0}),
     "its progress or number of cells is missing"),
    (None, "is not a regular file"),
])  # fmt: skip
def test_one_bad_work_file_is_told_and_hides_no_other(serve, folder, work, message):
    path = folder / "b.ply.studio.jsonl"
    path.mkdir() if work is None else path.write_bytes(work)
    listed = serve(folder).http.get("/api/files").json()
    assert len(listed) == 5
    assert [message in entry.get("error", "") for entry in listed] == [0, 1, 0, 0, 0]


@pytest.mark.parametrize("text", [
    "1,wall,#aec7e8\n\n40, other prop ,,1,x",
    "\ufeffName;ID;trainId;Color;key;isThing\nwall;1;7;174 199 232;;\nother prop;40;;;w;0",
    'name\tid\thasInstances\tcolor\nvoid\t0\nwall\t1\tNo\t"(174, 199,232)"\nother prop\t40\tno',
])  # fmt: skip
def test_classes_of_a_csv_file_keep_their_numbers(serve, sheet, tmp_path, text):
    (tmp_path / "nyu40.csv").write_text(text, encoding="utf-8")
    classes = labeling.read_classes(tmp_path / "nyu40.csv")
    found = [(entry["id"], entry["name"], entry.get("stuff")) for entry in classes]
    assert found == [(1, "wall", True), (40, "other prop", True)]
    assert classes[0]["color"] == "#aec7e8"
    client = serve(sheet, n_segments=20, classes=classes)
    client.paint_regions(40, 0)
    objects = client.get("export", what="objects", format="json").content
    other = serve(sheet, work=tmp_path / "other.jsonl", n_segments=20)
    files = [{"name": "a.objects.json", "data": base64.b64encode(objects).decode()}]
    other.done("import", files=files)
    np.testing.assert_array_equal(other.classes(), client.classes())
    assert other.state()["classes"][-1]["name"] == "other prop"


@pytest.mark.parametrize(("name", "content", "message"), [
    ("a.txt", b"\n", "no line has a class"),
    ("a.json", b"{", "it is not valid JSON: Expecting property name"),
    ("a.json", b"[" * 100_000, "it is nested too deeply"),
    ("a.csv", b"id,name", "no line has a class"),
    ("a.csv", b"7,a\nx,b", 'line 2: expected a whole number as id, found "x"'),
    ("a.csv", b"0,road", "line 1: the id of road is 0, which means no class: count from 1"),
    ("a.csv", b"id,name,stuff\n1,a,?", r"line 2: stuff must be 0 or 1, found \?"),
    ("a.csv", b"1,a\n1,b", "line 2: two classes have the same id: 1"),
    ("a.csv", b"id,name\n\n1,Chair\n0,void\n2,chair", "line 5: two classes have the same name"),
    ("a.txt", b"a\n\na", "line 3: two classes have the same name: a"),
    ("a.json", b'["a", "A"]', r"classes\[1\]: two classes have the same name: A"),
    ("a.csv", b"name,color,id\na,,1\nb,red,2", "line 3: color must be #rrggbb"),
    ("a.json", b'{"labels": [], "n": 2}', 'expected .* an object with the keys "labels", "n"'),
    ("a.json", b'{"categories": 3}', 'expected .* an object with the keys "categories"'),
    ("a.json", b"{}", "expected .* found an object without keys"),
    ("a.json", b"3", "expected .* found 3"),
    ("a.json", b'{"categories": [3]}', r"classes\[0\] must have an id, a name and a color"),
    ("a.json", b'{"categories": [{"name": "a"}]}', r"classes\[0\]: id must be a whole number"),
    *(("a.json", b'{"categories": [{"id": 1, "name": "a", "color": %b}]}' % color,
       r"classes\[0\]: color must be #rrggbb")
      for color in (b"[1, 2]", b"[1, 2, 300]", b"[1, 2, 3, 4]", b'"red"', b"{}")),
])  # fmt: skip
def test_a_file_that_is_no_list_of_classes_is_named(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=f"{name}: not a list of classes: {message}"):
        labeling.read_classes(tmp_path / name)
    (tmp_path / name).write_bytes(b"Stuhl,\xfc")
    with pytest.raises(ValueError, match=r"save the file as UTF-8 \(in Excel: CSV UTF-8\)$"):
        labeling.read_classes(tmp_path / name)


def test_classes_are_read_from_lists_of_names_and_from_exported_objects(tmp_path):
    path = tmp_path / "scan.objects.json"
    categories = [
        {"id": 2, "name": "Slab", "isthing": 0, "supercategory": "", "color": [1, 2, 3]},
        {"id": 12, "name": "wall", "isthing": 1}, {"id": 3, "name": "floor"},
    ]  # fmt: skip
    path.write_text(json.dumps({"images": [], "categories": categories}))
    assert labeling.read_classes(path)[0]["color"] == "#010203"
    found = [(c["id"], c["name"], "stuff" in c) for c in labeling.read_classes(path)]
    assert found == [(2, "Slab", True), (12, "wall", False), (3, "floor", False)]
    path.write_text('["roof", {"id": 2, "name": "wall", "stuff": true}]')
    found = [(c["id"], c["name"], "stuff" in c) for c in labeling.read_classes(path)]
    assert found == [(1, "roof", False), (2, "wall", True)]
    (tmp_path / "names.txt").write_text("roof\n\n wall \n")
    classes = labeling.read_classes(tmp_path / "names.txt")
    assert [(c["id"], c["name"], c["key"]) for c in classes] == [(1, "roof", ""), (2, "wall", "")]


@pytest.mark.parametrize(("entry", "message"), [
    (3, "must have an id, a name and a color"),
    *(({"id": number, "name": "a"}, "id must be a whole number from 1 to 65535")
      for number in (0, labeling.MAX_CLASS + 1, True)),
    *(({"id": 1, "name": name}, "name must have 1 to 200 character") for name in (" ", "a" * 201)),
    ({"id": 1, "name": "a", "color": "red"}, "color must be #rrggbb"),
    ({"id": 1, "name": "a", "key": "ab"}, "key must be one character"),
    ({"id": 1, "name": "a\ud800"}, "name is not valid Unicode: lone surrogate"),
    ({"id": 1, "name": "a", "key": "\udcff"}, "key is not valid Unicode: lone surrogate"),
    ({"id": 2, "name": "a"}, "two classes have the same id: 2"),
    ({"id": 1, "name": "a", "key": "x"}, "two classes have the same key: x"),
])  # fmt: skip
def test_wrong_classes_are_refused(entry, message):
    with pytest.raises(ValueError, match=message):
        labeling.checked_class_list([entry, {"id": 2, "name": "b", "key": "x"}])


def test_classes_at_the_limits_are_accepted():
    entries = [{"id": 1, "name": "a"}, {"id": labeling.MAX_CLASS, "name": "b" * 200}]
    assert [entry["name"] for entry in labeling.checked_class_list(entries)] == ["a", "b" * 200]


def test_classes_that_cells_have_are_added():
    assert [entry["id"] for entry in labeling.with_missing((), [0, 3, 1])] == [1, 3]


def test_a_mesh_that_another_studio_has_open_is_told(serve, folder):
    first, second = serve(folder), serve(folder)
    first.state(1)
    answer = second.get("state", 1)
    assert answer.status_code == 409
    assert "another studio has this work file open" in answer.json()["error"]
    assert second.state(2)["seq"] == 0


@pytest.mark.skipif(os.name == "nt", reason="names of files are text there")
def test_a_name_that_is_no_text_is_no_obstacle(serve, tmp_path):
    path = tmp_path / os.fsdecode(b"a\xff.ply")
    try:
        write_mesh(path, shapes.bumpy_sheet(4))
    except OSError:
        pytest.skip("the file system takes no such name")
    client = serve(tmp_path)
    assert client.http.get("/api/files").json()[0]["name"] == path.name
    client.paint_regions(1, 0)
    answer = client.get("export", what="cells", format="npy")
    assert "a%FF.classes.npy" in answer.headers["content-disposition"]
    client.close()
    assert serve(tmp_path).classes().any()


def colors(classes):
    return [entry["color"] for entry in classes]


def test_a_new_class_gets_a_default_color_that_differs_from_colors_in_use(tmp_path):
    default = colors(labeling.default_classes([str(i) for i in range(32)]))
    near = "#e59e01"  # the first default color, almost
    used = [{"id": 7, "name": "a", "color": default[1]}, {"id": 9, "name": "b", "color": near}]
    listed = labeling.checked_class_list([*used, {"id": 2, "name": "c"}, {"id": 1, "name": "d"}])
    assert colors(listed) == [default[1], near, default[2], default[3]]
    assert colors(labeling.with_missing(listed, [4]))[4:] == [default[4]]
    assert colors(labeling.with_named(listed, "e")[1])[4:] == [default[9]]  # 10 has its own
    (tmp_path / "classes.json").write_text(json.dumps([used[0], "c"]))
    assert colors(labeling.read_classes(tmp_path / "classes.json"))[1] == default[2]


def test_default_colors_repeat_only_after_all_are_in_use():
    default = colors(labeling.default_classes([str(i) for i in range(100)]))
    assert len({*default}) == 100
    classes = ()
    for number in range(108):
        _, classes = labeling.with_named(classes, str(number))
    assert colors(classes) == default + default[:8]


def test_many_new_classes_are_compared_with_the_colors_in_use_only_once(monkeypatch):
    calls = []

    def distances(*arguments):
        calls.append(arguments)
        return color_distances(*arguments)

    monkeypatch.setattr("superfacets_studio.labels.classes.color_distances", distances)
    known = labeling.default_classes()
    entries = [*known, *({"id": i, "name": str(i)} for i in range(7, 5001))]
    default = colors(labeling.default_classes([str(i) for i in range(100)]))
    expected = [default[i % 100] for i in range(5000)]
    assert colors(labeling.checked_class_list(entries)) == expected
    assert colors(labeling.with_missing(known, range(5001))) == expected
    cloud = superfacets.PointCloud(np.random.default_rng(0).random((5000, 3)))
    text = "".join(f"{i}\n" for i in range(1, 5001)).encode()
    assert colors(read_import({"a.txt": text}, cloud, known).class_list) == expected
    assert len(calls) == 3
