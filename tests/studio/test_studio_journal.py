"""The work file of the studio: its content survives any failure of the process."""

import contextlib
import copy
import errno
import json
import os
import zlib

import numpy as np
import pytest
import shapes

from superfacets import write_mesh
from superfacets_studio.documents.document import Document
from superfacets_studio.documents.history import History, NothingError
from superfacets_studio.documents.journal import VERSION, Journal, JournalError, _coded, summary
from superfacets_studio.labels.classes import default_classes
from superfacets_studio.labels.coding import base64_of, pack_cells

ONE = base64_of(pack_cells(np.array([1], np.uint32)))


def cells(*numbers):
    return np.array(numbers, np.uint32)


def opened(path):
    return Journal.open(path, {"n_cells": 9})


def test_lines_are_there_when_the_file_is_opened_again(tmp_path):
    journal = opened(tmp_path / "work")
    journal.append({"seq": 1, "name": "zweig ü"})
    journal.close()
    again = opened(tmp_path / "work")
    assert [line["name"] for line in again.lines] == ["zweig ü"]
    assert (again.header["n_cells"], again.notes) == (9, [])
    again.close()


def test_every_cut_of_the_file_leaves_the_operations_before_it(document, sheet):
    states = [document.state.classes.copy()]
    for number in range(1, 6):
        document.paint(document.revision.cells_of(number), number)
        states.append(document.state.classes.copy())
    document.undo()
    states.append(document.state.classes.copy())
    path, n_cells = document.journal.path, document.n_cells
    document.close()
    data = path.read_bytes()
    first = data.index(b"\n") + 1
    ends = [place for place in range(first - 1, len(data)) if data[place] == ord("\n")]
    near = {end + step for end in ends for step in (-1, 0, 1, 2)}
    for size in sorted({*range(first, len(data), 23), *near} & {*range(first, len(data) + 1)}):
        path.write_bytes(data[:size])
        journal = Journal.open(path, {})
        n_lines = data[:size].count(b"\n") - 1
        is_torn = not data[:size].endswith(b"\n")
        replay = History.replayed(journal, n_cells, None)
        journal.close()
        assert replay.seq == n_lines
        assert np.array_equal(replay.state.classes, states[n_lines])
        assert len(journal.notes) == is_torn
        assert path.read_bytes() == data[:size][: data[:size].rindex(b"\n") + 1]


@pytest.mark.parametrize("size", [0, 1, 10, 40])
def test_a_header_that_was_cut_is_written_again(tmp_path, size):
    path = tmp_path / "work"
    opened(path).close()
    whole = path.read_bytes()
    path.write_bytes(whole[:size])
    opened(path).close()
    assert path.read_bytes() == whole


def test_a_file_of_something_else_is_left_alone(tmp_path):
    path = tmp_path / "thesis.txt"
    path.write_text("all my words")
    with pytest.raises(
        JournalError, match=r"thesis\.txt: is not a work file of superfacets studio"
    ):
        opened(path)
    assert path.read_text() == "all my words"
    with pytest.raises(OSError, match="is not a regular file"):
        opened(tmp_path)


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_link_is_followed_where_the_user_names_it_and_nowhere_else(sheet, tmp_path):
    behind = tmp_path / "behind"
    behind.touch()
    link = tmp_path / "sheet.ply.studio.jsonl"
    link.symlink_to(behind)
    with pytest.raises(OSError, match=r"sheet\.ply\.studio\.jsonl: expected a file, got a link"):
        Document.open(sheet)
    with pytest.raises(JournalError, match="got a link"):
        summary(link)
    assert behind.read_bytes() == b""
    Document.open(sheet, link).close()
    assert behind.read_bytes() != b""


def test_damage_before_the_last_line_is_told_and_nothing_is_cut_off(tmp_path):
    path = tmp_path / "work"
    journal = opened(path)
    for number in range(3):
        journal.append({"seq": number})
    journal.close()
    data = bytearray(path.read_bytes())
    data[data.index(b'"seq":1') + 6] = ord("7")
    path.write_bytes(data)
    with pytest.raises(JournalError, match="line 3 of the work file is damaged"):
        opened(path)
    assert path.read_bytes() == data


def test_a_later_version_is_refused(tmp_path):
    later = {"format": "superfacets studio", "version": VERSION + 1, "n_cells": 9}
    (tmp_path / "work").write_bytes(_coded(later))
    with pytest.raises(JournalError, match="written by a later version"):
        opened(tmp_path / "work")


def test_a_second_studio_is_refused_as_long_as_the_first_is_there(document, sheet):
    with pytest.raises(JournalError, match="another studio has this work file open"):
        Document.open(sheet)
    document.paint(cells(1), 1)
    document.close()
    again = Document.open(sheet)
    assert again.state.classes[1] == 1
    again.close()


@pytest.fixture
def full_disk(monkeypatch):
    """Limit the space on the disk to ten bytes."""
    write, room = os.write, []

    def limited(file, data):
        if not room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, bytes(data[: room.pop()]))

    def fill():
        room[:] = [10]
        monkeypatch.setattr(os, "write", limited)

    return fill


def test_on_a_full_disk_nothing_changes_until_there_is_room(document, full_disk, monkeypatch):
    document.paint(cells(1, 2), 1)
    data, classes = document.journal.path.read_bytes(), document.state.classes.copy()
    path = document.journal.path.with_name("new")
    for operation in (
        lambda: document.paint(cells(2, 3), 2), document.undo, lambda: opened(path),
        lambda: document.set_classes([*document.class_list, {"id": 9, "name": "more"}]),
    ):  # fmt: skip
        full_disk()
        with pytest.raises(JournalError, match="No space left on device: the operation was not"):
            operation()
        monkeypatch.undo()
        assert (document.journal.path.read_bytes(), path.exists()) == (data, False)
        assert np.array_equal(document.state.classes, classes)
        assert (document.history.seq, len(document.history.undo_stack)) == (1, 1)
        assert len(document.class_list) == 6
    document.paint(cells(2, 3), 2)
    assert document.state.classes[:4].tolist() == [0, 1, 2, 2]


def test_a_file_that_can_not_be_mended_is_not_written_to_any_more(document, monkeypatch, broken):
    broken("os.write", OSError(errno.EIO, os.strerror(errno.EIO)))
    broken("os.ftruncate", OSError(errno.EIO, os.strerror(errno.EIO)))
    with pytest.raises(JournalError, match="Input/output error"):
        document.paint(cells(1), 1)
    monkeypatch.undo()
    with pytest.raises(JournalError, match="can no longer be written"):
        document.paint(cells(1), 1)
    assert document.history.seq == 0


def test_a_work_file_that_is_taken_away_or_changed_is_noticed(document):
    path = document.journal.path
    moved = path.rename(path.with_name("moved"))
    with pytest.raises(JournalError, match="the work file is gone"):
        document.paint(cells(1), 1)
    path.write_text("")
    with pytest.raises(
        JournalError, match="another program changed the work file: start the studio again"
    ):
        document.paint(cells(1), 1)
    moved.replace(path)
    document.paint(cells(1), 1)
    with path.open("ab") as file:
        file.write(b"x")
    with pytest.raises(JournalError, match="another program changed the work file"):
        document.paint(cells(2), 1)


def test_a_closed_journal_takes_nothing(document):
    document.close()
    with pytest.raises(JournalError, match="the work file is closed"):
        document.paint(cells(1), 1)


def test_a_line_that_makes_no_sense_is_told_with_its_number(document, sheet):
    document.paint(cells(1), 1)
    document.journal.append({"seq": 2, "op": "redo"})
    document.close()
    with pytest.raises(
        JournalError, match="line 3 of the work file is not valid: there is nothing to redo"
    ):
        Document.open(sheet)


@pytest.mark.parametrize(("line", "message"), [
    ({"seq": 5, "op": "undo"}, "seq must be 1, got 5"),
    ({"seq": 1, "op": "paint", "cells": "", "class": 1}, "packed numbers are damaged"),
    ({"seq": 1, "op": "dance"}, "unknown operation dance"),
    ({"seq": 1, "op": ["undo"]}, r"unknown operation \['undo'\]"),
    ({"seq": 1, "op": "paint", "class": 1}, "'cells' is missing"),
    ({"seq": 1, "op": "paint", "cells": 3, "class": 1}, "cells must be base64"),
    ({"seq": 1, "op": "paint", "cells": ONE, "class": 70_000},
     "class must be 0 to 65535, got 70000"),
    ({"seq": 1, "op": "paint", "cells": ONE, "class": -1}, "class must be 0 to 65535, got -1"),
    ({"seq": 1, "op": "paint", "cells": ONE, "class": 10**30},
     "class must be 0 to 65535, got 10+"),
    ({"seq": 10**400, "op": "undo"}, r"seq must be 1, got 10{170,200}\.\.\.$"),
])  # fmt: skip
def test_lines_that_make_no_sense(document, sheet, line, message):
    document.journal.append(line)
    document.close()
    with pytest.raises(JournalError, match=message) as raised:
        Document.open(sheet)
    assert len(str(raised.value)) < 400


@pytest.mark.parametrize("inside", [b"[" * 100_000, b'{"a":'], ids=["deep", "torn"])
def test_a_line_that_is_no_json_is_damaged_though_its_sum_is_right(document, sheet, inside):
    path = document.journal.path
    document.paint(cells(1), 1)
    document.close()
    first, last = path.read_bytes().splitlines(keepends=True)
    body = b'{"seq":1,"op":' + inside
    path.write_bytes(first + body + b',"crc":"%08x"}\n' % zlib.crc32(body) + last)
    with pytest.raises(JournalError, match="line 2 of the work file is damaged"):
        Document.open(sheet)
    assert summary(path)[1]["seq"] == 1
    begin = first[: first.index(b'"version"')] + b'"x":' + inside
    path.write_bytes(begin + b',"crc":"%08x"}\n' % zlib.crc32(begin) + last)
    for look in (summary, lambda _: Document.open(sheet)):
        with pytest.raises(JournalError, match="line 1 of the work file is damaged"):
            look(path)


def _places(value, path=()):
    """Yield the path to each value in JSON, at every depth."""
    inside = enumerate(value) if isinstance(value, list) else ()
    for key, child in value.items() if isinstance(value, dict) else inside:
        yield (*path, key)
        yield from _places(child, (*path, key))


def _exchanged(line, path, value):
    changed = copy.deepcopy(line)
    inner = changed
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return changed


WRONG = (None, True, -1, 1, 70_000, 2**64, float("nan"), 1e999, "", "x", "\ud800", [], {}, [[1]])


def test_a_work_file_with_any_value_exchanged_is_read_or_refused_with_its_name(tmp_path):
    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(4))
    document = Document.open(path, n_segments=3, classes=default_classes(["one", "two"]))
    whole = document.revision.cells_of(0)
    document.paint(whole, 1, "stroke")
    document.paint(np.arange(4, dtype=np.uint32), np.array([1, 2, 1, 2]))
    document.split(0, document.revision.number, whole[:1], whole[-1:])
    document.set_classes([{"id": 1, "name": "one"}, {"id": 2, "name": "new"}])
    document.close()
    work = document.journal.path
    lines = [json.loads(line) for line in work.read_text().splitlines()]
    n_refused = 0
    for number, line in enumerate(lines):
        for place in _places(line):
            for value in WRONG:
                changed = [*lines[:number], _exchanged(line, place, value), *lines[number + 1 :]]
                data = b"".join(_coded({**entry, "crc": 0}) for entry in changed)
                n_refused += not _is_read(path, work, data)
    assert n_refused > 500


def _is_read(path, work, data):
    work.write_bytes(data)
    try:
        document = Document.open(path)
    except JournalError as error:
        return not str(error).startswith(f"{work}: ")
    with contextlib.suppress(NothingError):
        for _ in range(5):
            document.undo()
    document.close()
    return True


def test_halves_of_surrogate_pairs_in_an_old_work_file_are_left_out(document, sheet):
    document.journal.append(
        {"seq": 1, "op": "classes", "classes": [{"id": 1, "name": "a\ud83d", "key": "\ud83d"}]}
    )
    document.close()
    again = Document.open(sheet)
    assert (again.class_list[0]["name"], again.class_list[0]["key"]) == ("a", "")
    again.close()


def test_a_paint_that_changes_nothing_makes_no_sense(document, sheet):
    document.paint(cells(1), 1)
    text = document.journal.path.read_text().splitlines()[-1].split('"cells":"')[1].split('"')[0]
    document.journal.append({"seq": 2, "op": "paint", "cells": text, "class": 1})
    document.close()
    with pytest.raises(JournalError, match="it changes no cell"):
        Document.open(sheet)


def test_active_time_and_strokes_add_up_over_sessions(document, sheet, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("time.time", lambda: clock[0])
    whole, number = document.revision.cells_of(0), document.revision.number
    assert document.statistics == {}
    for moment, operation in (
        (100, lambda: document.paint(cells(1), 1, "a", part=0)),
        (130, lambda: document.paint(cells(2), 1, "a", part=1)),  # the same stroke
        (190, lambda: document.split(0, number, whole[:1], whole[-1:])),  # after a whole minute
        (250.5, document.undo),  # after a pause
        (251.5, document.redo),
        (20, lambda: document.review(True)),  # the clock was set back
        (25.5, lambda: document.set_classes(default_classes(["one"]))),
    ):  # fmt: skip
        clock[0] = moment
        operation()
    document.close()
    again, clock[0] = Document.open(sheet), 30
    again.paint(cells(7), 1)
    took = {"statistics": {"seconds": 30 + 60 + 1 + 5.5 + 4.5, "strokes": 3}}
    assert again.statistics == took
    with pytest.raises(NothingError):
        again.redo()
    assert again.statistics == took
    again.journal.append({"seq": 9, "op": "undo", "time": 31, "seconds": -1, "strokes": 3})
    again.close()
    again = Document.open(sheet)
    assert (again.state.classes[7], again.statistics) == (0, {})
    again.close()


def test_the_summary_is_the_first_and_the_last_line(document, tmp_path):
    path = document.journal.path
    assert summary(path)[1]["format"] == "superfacets studio"
    for number in range(40):  # more than one read returns
        document.paint(np.arange(number, 1000, 7, dtype=np.uint32), 1 + number % 6)
    document.paint(np.arange(1152, dtype=np.uint32), np.random.default_rng(0).integers(1, 7, 1152))
    many = [{"id": number, "name": "n" * 100} for number in range(1, 60)]
    document.set_classes(many)  # a line longer than the first block read
    with path.open("ab") as file:
        file.write(b"{torn")
    first, last = summary(path)
    assert (first["n_cells"], last["seq"]) == (1152, 42)
    assert last["done"] == 1
    assert summary(tmp_path / "none") is None
    (tmp_path / "other").write_text("x\ny\n")
    with pytest.raises(JournalError, match="other: line 1 of the work file is damaged"):
        summary(tmp_path / "other")
