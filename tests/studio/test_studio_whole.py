"""Each operation is done whole or not at all, in memory, on disk, and after a kill."""

import errno
import json
import os

import numpy as np
import pytest
import shapes
from studio_client import encoded

from superfacets import MeshError, write_mesh
from superfacets_studio.documents.changes import Change
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.history import History
from superfacets_studio.documents.journal import Journal, WriteError
from superfacets_studio.export import objects
from superfacets_studio.export.write import write_export
from superfacets_studio.labels.classes import CLASSES_FILE
from superfacets_studio.labels.imports import read_import

N_CELLS = 1152  # of the fixture `sheet`


def annotated(*annotations):
    """Return the files of an import, with 50 cells in each annotation."""
    documents = [
        {
            "category_id": 1,
            "segmentation": {"counts": [50 * i, 50, N_CELLS - 50 * (i + 1)]},
            **entry,
        }
        for i, entry in enumerate(annotations)
    ]
    content = {"categories": [{"id": 1, "name": "new"}], "annotations": documents}
    return {"objects.objects.json": json.dumps(content).encode()}


def imported(document, *annotations):
    return read_import(annotated(*annotations), document.cells, document.class_list)


def do_import(document):
    document.apply_import(imported(document, {"name": "my chair"}, {}))


def do_suggest(document):
    document.suggest(imported(document, {"score": 0.5}, {}, {}))


def do_settle(document):
    document.settle({1: 2, 2: 3}, [3])


def do_accept(document):
    document.accept(np.arange(300, dtype=np.uint32), "theirs")


def do_split_of_another_version(document):
    whole = document.revision.cells_of(1)
    document.split(1, document.revision.number, whole[:1], whole[-1:])


def do_undo(document):
    document.undo()


def do_redo(document):
    document.redo()


def compared(document, tmp_path):
    """Compare with work that has a class of its own."""
    other = Document.open(document.path, tmp_path / "other.jsonl", n_segments=20)
    do_import(other)
    data = other.journal.path.read_bytes()
    other.close()
    document.compare("other.jsonl", data)


def foreign(document, tmp_path):
    """Make the stored regions regions of another version."""
    base = document.base
    parameters = dict(document.state.partition.parameters, n_segments=19)
    document.set_base(parameters, document.segmenter.base(parameters))
    document.base = base


OPERATIONS = {
    "import": ([], do_import), "suggest": ([], do_suggest), "settle": ([do_suggest], do_settle),
    "merge": ([compared], do_accept), "split": ([foreign], do_split_of_another_version),
    "undo": ([do_import], do_undo), "undo of settle": ([do_suggest, do_settle], do_undo),
    "redo": ([do_import, do_undo], do_redo),
}  # fmt: skip


@pytest.fixture(params=OPERATIONS)
def prepared(request, document, tmp_path):
    """Return a document with some labels, and an operation with several changes."""
    document.paint(np.arange(20, 120, dtype=np.uint32), 1, objects=1)
    before, operation = OPERATIONS[request.param]
    for step in before:
        step(document, *([tmp_path] if step in (compared, foreign) else []))
    return document, lambda: operation(document)


def state_of(history):
    """Return all of the state that a journal restores, in values that can be compared."""
    state = history.state
    stacks = len(history.undo_stack), len(history.redo_stack)
    return (
        state.paint.tolist(), state.class_list, state.partition, state.object_names,
        state.is_reviewed, state.is_changed, state.suggestions, history.seq, stacks,
    )  # fmt: skip


def whole_state(document):
    shown = document.revision.number, document.revision.labels.tolist(), document.base.digest
    return *state_of(document.history), shown, document.journal.path.read_bytes()


def failing(monkeypatch, name, after=0):
    """Make a system call fail with a full disk; the first `after` bytes can still be written."""
    real, room = getattr(os, name), [after] if after else []

    def fail(file, *data):
        if room:
            return real(file, bytes(data[0][: room.pop()]))
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, name, fail)


@pytest.mark.parametrize(("name", "after"), [("write", 0), ("write", 9), ("fsync", 0)])
def test_on_a_full_disk_an_operation_leaves_nothing(prepared, monkeypatch, name, after):
    document, operation = prepared
    before = whole_state(document)
    failing(monkeypatch, name, after)
    with pytest.raises(WriteError, match="No space left on device: the operation was not done"):
        operation()
    monkeypatch.undo()
    assert whole_state(document) == before
    if name == "write":
        operation()  # works as soon as there is room
        assert document.history.seq == before[7] + 1


def test_an_interrupt_while_an_operation_is_written_leaves_nothing(prepared, monkeypatch):
    document, operation = prepared
    before = whole_state(document)

    def interrupt(file):
        monkeypatch.undo()
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        operation()
    assert whole_state(document) == before
    operation()
    assert document.history.seq == before[7] + 1


@pytest.mark.parametrize("n_before", range(3))
def test_an_error_at_any_change_reverts_the_changes_before_it(prepared, monkeypatch, n_before):
    document, operation = prepared
    before, real, calls = whole_state(document), Change.do, []

    def do(change, state):
        calls.append(change)
        if len(calls) == n_before + 1:
            raise MemoryError
        real(change, state)

    monkeypatch.setattr(Change, "do", do)
    try:
        operation()
    except MemoryError:
        assert whole_state(document) == before
    else:
        assert len(calls) == n_before  # the operation has no more changes


def test_after_a_kill_an_operation_is_there_whole_or_not_at_all(prepared):
    document, operation = prepared
    before, path, n_cells = state_of(document.history), document.journal.path, document.n_cells
    size = path.stat().st_size
    operation()
    after, data = state_of(document.history), path.read_bytes()
    assert data.count(b"\n", size) == 1  # one line, so one write
    document.close()
    for end in range(size, len(data) + 1):
        path.write_bytes(data[:end])
        journal = Journal.open(path, {})
        found = state_of(History.replayed(journal, n_cells, None))
        journal.close()
        assert found == (after if end == len(data) else before)


@pytest.mark.parametrize("prepared", [*OPERATIONS][:4], indirect=True)
def test_one_undo_reverts_an_operation_also_after_a_restart(prepared):
    document, operation = prepared
    before = state_of(document.history)[:-2]
    operation()
    document.close()
    again = Document.open(document.path)
    again.undo()
    assert state_of(again.history)[:-2] == before
    again.close()


def test_a_refused_import_leaves_nothing(client):
    """The name of the object is too long, which is found after its cells are painted."""
    before = client.state()
    [(name, data)] = annotated({}, {"name": "x" * 201}).items()
    files = [
        {"name": name, "data": encoded(np.frombuffer(data.ljust(-4 * (-len(data) // 4)), "<u4"))}
    ]
    answer = client.post("import", files=files)
    assert answer.status_code == 400
    assert "at most 200 characters" in answer.json()["error"]
    assert client.state() == before
    assert not client.classes().any()


@pytest.mark.parametrize("name", ["write", "fsync"])
def test_an_import_that_fails_takes_new_classes_out_of_the_list_of_the_folder(
    serve, tmp_path, monkeypatch, name
):
    for file in ("a.ply", "b.ply"):
        write_mesh(tmp_path / file, shapes.bumpy_sheet(24))
    client = serve(tmp_path, n_segments=20)
    with client.files.document(0) as document, client.files.document(1) as other:
        document.set_classes(list(document.class_list))
        before = document.class_list, (tmp_path / CLASSES_FILE).read_bytes(), whole_state(document)
        failing(monkeypatch, name)
        with pytest.raises(WriteError):
            do_import(document)
        monkeypatch.undo()
        shared = (tmp_path / CLASSES_FILE).read_bytes()
        assert (document.class_list, shared, whole_state(document)) == before
        assert other.class_list == before[0]


def test_of_an_export_of_two_files_both_are_written_or_none(document, monkeypatch):
    document.paint(np.arange(20, 120, dtype=np.uint32), 1, objects=1)
    paths = [write_export(document, "objects", "segs.json")]
    paths.append(paths[0].with_name(paths[0].name.replace("segs", "aggregation")))
    before = [path.read_bytes() for path in paths]
    document.paint(np.arange(20, 300, dtype=np.uint32), 2, objects=1)
    monkeypatch.setitem(objects._WRITERS, "aggregation.json", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_export(document, "objects", "segs.json")
    assert [path.read_bytes() for path in paths] == before


@pytest.mark.parametrize(("changes", "reason"), [
    ([], "it changes nothing"), ([{"op": "several", "changes": []}], "unknown operation several"),
    ([{"op": "undo"}], "unknown operation undo"), (["paint"], "string indices must be integers"),
    (7, "'int' object is not iterable"),
])  # fmt: skip
def test_a_line_of_several_changes_that_makes_no_sense_is_refused(document, changes, reason):
    document.journal.append({"seq": 1, "op": "several", "changes": changes})
    document.close()
    with pytest.raises(MeshError, match=f"line 2 of the work file is not valid: {reason}"):
        Document.open(document.path)
