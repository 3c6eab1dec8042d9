"""No number in a file or a request makes the studio overrun memory, allocate it, or fail."""

import ast
import base64
import importlib
import itertools
import json
import pkgutil
import zlib
from pathlib import Path

import numpy as np
import pytest
import shapes

import superfacets_studio
from superfacets import MeshError, write_mesh
from superfacets.kit import parsed_json
from superfacets_studio.documents.journal import _coded
from superfacets_studio.labels.coding import unpack_cells
from superfacets_studio.labels.imports import read_import
from superfacets_studio.web.operations import OPERATIONS

SIZED = {
    "arange", "at", "bincount", "broadcast_to", "cumsum", "empty", "frombuffer",
    "full", "ones", "reduceat", "repeat", "tile", "zeros", "components", "count_segments",
}  # fmt: skip
"""Functions that allocate memory, or write to it, as their arguments say."""

OWN = "sizes are numbers of cells, regions or objects of the open mesh, not numbers in a file"
CLASSES = "class numbers are at most MAX_CLASS: uint16 in `State.paint`, or `checked_class_list`"

GUARDS = {
    "scans.aggregation.objects_of": "as many as the file lists; ids are found by searchsorted",
    "scans.aggregation.regroup_segments": "as many as the files list; they must be equally many",
    "scans.segmentator._edges_of": "`_checked_edges` refuses ends outside of the points",
    "scans.segmentator.segment_mesh": OWN, "scans.segmentator._graph_of": OWN,
    "scans.segmentator._merged": "labels are those of regions of faces",
    "scans.segmentator.segment_point": "`_checked_edges` refuses ends outside of the points",
    "studio.documents.agreement._ious": OWN,
    "studio.documents.agreement._matched_classes": CLASSES,
    "studio.documents.agreement._matched_objects": OWN, "studio.documents.agreement._overlaps": OWN,
    "studio.documents.changes.cells": "constant",
    "studio.documents.changes.objects": "constant; `checked_class_list` limits class numbers",
    "studio.documents.changes.painting": "cells are checked; as many values as cells, or an error",
    "studio.documents.changes.unpacked": "compressed by `Painted.of`, not read from a file",
    "studio.documents.document.agreement": OWN, "studio.documents.document._paint_suggestions": OWN,
    "studio.documents.document.apply_import": "constant; classes are uint16",
    "studio.documents.document.class_list": CLASSES,
    "studio.documents.document.set_classes": CLASSES, "studio.documents.document.split_object": OWN,
    "studio.documents.journal_lines._read_numbers": "`inflated` stops at two bytes per cell",
    "studio.documents.journal_lines.first_state": "`check_source` compares n_cells with the mesh",
    "studio.export.objects._write_table": OWN, "studio.export.write._colors_of": CLASSES,
    "studio.export.write._write_region_classes": OWN, "studio.export.write.class_of_regions": OWN,
    "studio.labels.classes._free_colors": "constant", "studio.web.operations.border_packet": OWN,
    "studio.labels.coding.cells_from": "as many as the request has; each must be a cell",
    "studio.labels.coding.unpack_cells": "`inflated` stops at five bytes per cell; the sum of all "
    "differences is compared with the number of cells in float64, where it cannot wrap",
    "studio.labels.imports.__init__": OWN, "studio.labels.coding.pack_cells": OWN,
    "studio.labels.imports._by_annotation": "no run above the number of cells, so no sum wraps",
    "studio.labels.imports._by_number": OWN, "studio.labels.suggestions._pieces": OWN,
    "studio.labels.suggestions.suggestions_of": OWN, "studio.regions.revisions._beyond_steps": OWN,
    "studio.regions.revisions._by_region": OWN, "studio.regions.revisions._shapes": OWN,
    "studio.regions.revisions.is_reached": OWN, "studio.regions.splitting._cut": OWN,
    "studio.regions.splitting._region_graph": OWN, "studio.regions.splitting._without_stroke": OWN,
    "studio.regions.segmenting.divided": OWN, "studio.web.operations._suggestion_packet": OWN,
}  # fmt: skip
"""What bounds the sizes in each function that calls one of `SIZED`."""


def sized_functions():
    scans = ("superfacets_scans.aggregation", "superfacets_scans.segmentator")
    studio = pkgutil.walk_packages(superfacets_studio.__path__, "superfacets_studio.")
    for module in (*scans, *(found.name for found in studio)):
        path = importlib.util.find_spec(module).origin
        for function in ast.walk(ast.parse(Path(path).read_text(encoding="utf-8"))):
            calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
            names = {getattr(call.func, "attr", "") for call in calls}
            if isinstance(function, ast.FunctionDef) and names & SIZED:
                yield f"{module.removeprefix('superfacets_')}.{function.name}"


def test_the_guard_of_each_sized_call_is_listed():
    assert {*sized_functions()} == {*GUARDS}


def objects_of(n_cells, counts, **entries):
    annotation = {"category_id": 1, "segmentation": {"counts": counts}, **entries}
    return {"categories": [{"id": 1, "name": "a"}], "annotations": [annotation]}


def coded(document):
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    return base64.b64encode(text).decode()


@pytest.mark.parametrize(("counts", "message"), [
    ([2**63 - 1, 2**63 - 1, 1154], "counts must be 0 to 1152"),  # the sum wraps to 1152
    ([1153, -1], "counts must be 0 to 1152"),
    ([1152] * 5, "an annotation has 5760 cells, but the mesh has 1152"),
    ([2**63, 1], "which does not fit into 64 bits"),
    ([1e300, 1], "counts must be a list of whole numbers"),
    ([[1152]], "counts must be a list of whole numbers"),
    ({"a": 1}, "counts must be a list of whole numbers"),
])  # fmt: skip
def test_run_lengths_that_do_not_fit_the_mesh_are_refused(client, counts, message):
    files = [{"name": "a.objects.json", "data": coded(objects_of(1152, counts))}]
    answer = client.post("import", files=files)
    assert (answer.status_code, message in answer.json()["error"]) == (400, True), answer.text
    assert client.state()["seq"] == 0


@pytest.mark.parametrize("n", [2, 2**10])
def test_packed_cells_whose_sum_wraps_are_refused(n):
    largest = b"\xff\xff\xff\xff\x7f"  # 2**35 - 1
    with pytest.raises(ValueError, match="cells must be ascending numbers between 0 and"):
        unpack_cells(zlib.compress(largest * n), n)
    with pytest.raises(ValueError, match="packed numbers are damaged"):
        unpack_cells(zlib.compress(b"\1" * (5 * n + 1)), n)


@pytest.mark.parametrize(("text", "message"), [
    ("[1e999]", "the number 1e999, which does not fit into 64 bits"),
    ("[-1e999]", "the number -1e999, which"), ("[NaN]", "the number NaN, which"),
    ("[Infinity]", "the number Infinity, which"),
    ("[9223372036854775808]", "the number 9223372036854775808, which"),
    (f"[{'9' * 9999}]", "the number 9{197}..., which"),
    ('{"a": 1, "b": {"c": 1, "c": 2}}', "it has an object with the key c twice"),
    ("[" * 100_000, "it is nested too deeply"), ('{"a":' * 100_000, "it is nested too deeply"),
    ("[1,", r"it is not valid JSON: Expecting value: line 1 column 4 \(char 3\)"),
    ("", "it is not valid JSON"), (b"\xff", "it is not valid JSON"),
    (b'{"a": "\xff"}', "it is not valid JSON"),
])  # fmt: skip
def test_json_that_python_would_change_or_fail_at_is_refused(text, message):
    with pytest.raises(MeshError, match=message) as raised:
        parsed_json(text)
    assert len(str(raised.value)) < 300
    assert "\n" not in str(raised.value)
    limits = [2**63 - 1, -(2**63), 1.7976931348623157e308, 5e-324]
    assert parsed_json(json.dumps(limits)) == limits


WRONG = ("null", "true", "-1", "0", "1.5", "9223372036854775807", "1e308", '"x"', "[]", "{}",
         "[[1]]", '{"a":1}', "1e999", "NaN", "9" * 400, "[" * 5000, '{"a":1,"a":2}')  # fmt: skip
"""Values of other types, and texts that are not JSON."""


def exchanged(value):
    """Yield JSON in which one value, at any depth, is exchanged for each of `WRONG`."""
    marked = "exchange me"
    for place in places(value):
        text = json.dumps(replaced(value, place, marked))
        yield from (text.replace(f'"{marked}"', wrong) for wrong in WRONG)


def places(value, path=()):
    inside = value.items() if isinstance(value, dict) else ()
    for key, child in enumerate(value) if isinstance(value, list) else inside:
        yield (*path, key)
        yield from places(child, (*path, key))


def replaced(value, place, new):
    if not place:
        return new
    copy = value.copy()
    copy[place[0]] = replaced(value[place[0]], place[1:], new)
    return copy


@pytest.fixture
def small(serve, tmp_path):
    """Return a client for a mesh of 32 faces, of which each request can be tried often."""
    write_mesh(tmp_path / "small.ply", shapes.bumpy_sheet(4))
    return serve(tmp_path / "small.ply", n_segments=3)


def is_one_line(answer):
    error = answer.json().get("error", "") if answer.status_code >= 400 else "none"
    return answer.status_code < 500 and 0 < len(error) < 500 and "\n" not in error


FIRST = base64.b64encode(np.array([0, 1], "<u4").tobytes()).decode()

BODIES = {
    "paint": {"class": 1, "cells": FIRST, "stroke": "a", "object": 1},
    "similar": {"region": 0, "revision": 0, "tolerance": 0.1},
    "classes": {"classes": [{"id": 1, "name": "a", "color": "#123456", "key": "", "stuff": True}]},
    "split": {"red": [0], "blue": [1], "region": 0, "revision": 0},
    "split-object": {"class": 1, "object": 1},
    "name-object": {"class": 1, "object": 1, "name": "x"},
    "accept": {"cells": FIRST, "side": "mine"},
    "compare": {"files": [{"name": "x", "data": FIRST}]},
    "review": {"reviewed": True},
    "settle": {"accept": [[1, 1]], "reject": [2]},
    "export": {"what": "cells", "format": "npy", "replace": False},
    "import": {"files": [{"name": "a.txt", "data": FIRST}], "as_suggestions": False},
    "refine": {"region": 0, "revision": 0, "parts": 2},
    "undo": {"x": 1}, "redo": {"x": 1},
    "segment": {"n_segments": 3, "alpha": 1.0, "ridges": 0.5, "smooth": True, "level": None},
}  # fmt: skip


def test_each_operation_is_tried():
    assert {*BODIES} == {*OPERATIONS, "segment"}


@pytest.mark.parametrize("name", BODIES)
def test_any_value_in_a_request_is_taken_or_refused_in_one_line(small, name):
    body = BODIES[name]
    if "revision" in body:
        body = {**body, "revision": small.state()["revision"]}
    for text in exchanged(body):
        answer = small.http.post(f"/api/files/0/{name}", content=text)
        assert (name == "segment" and answer.status_code == 200) or is_one_line(answer), text
    assert small.get("state").status_code == 200


AGGREGATION = {
    "sceneId": "s", "segGroups": [{"id": 0, "objectId": 0, "segments": [0, 1], "label": "a"}],
}  # fmt: skip
FILES = {
    ".objects.json": objects_of(32, [1, 2, 29], name="b", object=1, iscrowd=0, score=0.5),
    ".segs.json": {"segIndices": [*range(25)]}, ".aggregation.json": AGGREGATION,
    ".sstk.json": {"segmentation": [{"index": [0] * 32}]},
}  # fmt: skip


@pytest.mark.parametrize("ending", FILES)
def test_any_value_in_a_file_is_imported_or_refused_in_one_line(small, ending):
    others = {"a.segs.json": FILES[".segs.json"]} if ending == ".aggregation.json" else {}
    texts = itertools.islice(exchanged(FILES[ending]), 400)
    for text in texts:
        given = {f"a{ending}": text.encode(), **others}
        files = [{"name": name, "data": coded(data)} for name, data in given.items()]
        for as_suggestions in (True, False):
            answer = small.post("import", files=files, as_suggestions=as_suggestions)
            assert is_one_line(answer), text
    assert small.get("state").status_code == 200


@pytest.mark.parametrize("name", ["classes", "parameters", "n_cells", "file", "kind", "version"])
def test_a_work_file_without_an_entry_is_compared_or_refused_in_one_line(client, name):
    client.paint_regions(1, 0)
    header, *lines = client.document().journal.path.read_bytes().splitlines(keepends=True)
    entries = {key: value for key, value in json.loads(header).items() if key not in (name, "crc")}
    work = b"".join([_coded(entries), *lines])
    answer = client.post("compare", files=[{"name": "work", "data": coded(work)}])
    assert is_one_line(answer), answer.text
    assert answer.status_code == (200 if name == "kind" else 409), answer.text


def test_text_and_whole_numbers_in_objects_are_checked(sheet, document):
    wrong = objects_of(1152, [1152])
    for entry, value, message in (
        ("id", "1", "id must be a whole number, got '1'"),
        ("id", True, "id must be a whole number, got True"),
        ("name", None, "name must be text, got None"),
    ):  # fmt: skip
        content = {**wrong, "categories": [{**wrong["categories"][0], entry: value}]}
        with pytest.raises(MeshError, match=message):
            read_import({"a.objects.json": json.dumps(content).encode()}, document.cells, ())
