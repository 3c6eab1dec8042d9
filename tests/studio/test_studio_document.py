"""The state of the work in the studio."""

import numpy as np
import pytest
import shapes

from superfacets import write_mesh
from superfacets_studio.documents import document as module
from superfacets_studio.documents.changes import Change
from superfacets_studio.documents.document import Document, work_file_of
from superfacets_studio.documents.history import NothingError, last_stroke
from superfacets_studio.documents.journal import JournalError
from superfacets_studio.documents.source import ChangedError
from superfacets_studio.regions.revisions import GoneError


def cells(*numbers):
    return np.array(numbers, np.uint32)


def reopened(document):
    document.close()
    return Document.open(document.path)


def test_a_paint_is_undone_and_done_again(document):
    document.paint(cells(1, 2), 1)
    document.paint(cells(2, 3), 2)
    assert document.state.classes[:5].tolist() == [0, 1, 2, 2, 0]
    document.undo()
    assert document.state.classes[:5].tolist() == [0, 1, 1, 0, 0]
    document.redo()
    document.undo()
    document.undo()
    assert not document.state.classes.any()
    with pytest.raises(NothingError, match="there is nothing to undo"):
        document.undo()


def test_a_new_operation_ends_what_could_be_redone(document):
    document.paint(cells(1), 1)
    document.undo()
    document.paint(cells(2), 1)
    with pytest.raises(NothingError, match="there is nothing to redo"):
        document.redo()


def test_what_changes_nothing_is_no_operation(document):
    document.paint(cells(1), 1)
    assert document.paint(cells(1), 1) is None
    assert document.history.seq == 1


def test_a_stroke_is_undone_as_one(document):
    document.paint(cells(0), 1)
    for number in range(3):
        document.paint(cells(number, 5), 2 + number, "a")
    document.paint(cells(9), 1, "b")
    document.undo()
    document.undo()
    assert document.state.classes[:10].tolist() == [1] + [0] * 9
    document.redo()
    assert document.state.classes[:6].tolist() == [2, 3, 4, 0, 0, 4]


def test_a_part_that_is_sent_again_is_not_applied_twice_even_after_undo_and_reopening(sheet):
    document = Document.open(sheet, n_segments=20)
    assert document.paint(cells(1), 1, "a", part=3) is not None
    assert document.paint(cells(2), 1, "a", part=4) is not None
    document.undo()
    assert document.paint(cells(2), 1, "a", part=4) is None
    document.close()
    document = Document.open(sheet)
    assert document.paint(cells(1), 1, "a", part=3) is None
    assert not document.state.classes.any()
    assert document.paint(cells(2), 1, "a", part=5) is not None
    assert document.paint(cells(3), 1, "b", part=0) is not None
    document.close()


def test_paints_without_a_stroke_are_undone_one_by_one():
    one, other = (Change("paint", None, None) for _ in range(2))
    assert last_stroke([one, other]) == [other]
    assert last_stroke([]) == []


def test_all_operations_come_back_after_a_restart(document):
    classes = [{"id": number, "name": f"part {number}"} for number in (1, 2, 300)]
    document.set_classes(classes)
    document.paint(document.revision.cells_of(3), 300)
    region = document.revision.cells_of(4)
    document.paint(document.split(4, document.revision.number, region[:1], region[-1:]), 2)
    document.paint(cells(1, 2, 3), [1, 2, 1])
    document.undo()
    labels, before = document.revision.labels, document.state.classes
    again = reopened(document)
    assert np.array_equal(again.state.classes, before)
    assert np.array_equal(again.revision.labels, labels)
    assert again.class_list == document.class_list
    assert again.history.seq == document.history.seq
    again.redo()
    assert again.state.classes[1:4].tolist() == [1, 2, 1]
    for _ in range(4):
        again.undo()
    assert again.revision.n_regions == 20
    assert not again.state.classes.any()
    again.close()


def test_new_regions_leave_paint_as_it_is_and_can_be_undone(document):
    document.paint(document.revision.cells_of(3), 1)
    before, old = document.state.classes.copy(), document.revision
    parameters = {**document.state.partition.parameters, "n_segments": 7}
    revision = document.set_base(parameters, document.segmenter.run(parameters))
    assert revision.n_regions == 7
    assert np.array_equal(document.state.classes, before)
    again = reopened(document)
    assert again.revision.n_regions == 7
    again.undo()
    assert again.revision.n_regions == 20
    assert np.array_equal(again.revision.labels, old.labels)
    assert again.revision.number != old.number
    again.close()


def test_the_same_parameters_again_are_no_operation(document):
    parameters = document.state.partition.parameters
    document.set_base(parameters, document.segmenter.run(parameters))
    assert document.history.seq == 0


def test_a_split_region_is_whole_again_after_an_undo(document):
    number, region = document.revision.number, document.revision.cells_of(2)
    blue = document.split(2, number, region[:1], region[-1:])
    assert document.revision.n_regions == 21
    assert np.array_equal(document.revision.cells_of(20), blue)
    with pytest.raises(GoneError, match="the regions have changed"):
        document.split(2, number, region[:1], region[-1:])
    document.undo()
    assert document.revision.number == number


@pytest.fixture
def foreign(document, monkeypatch):
    """Return a document with a split and a stroke, opened by a version that makes other regions."""
    region = document.revision.cells_of(2)
    document.split(2, document.revision.number, region[:1], region[-1:])
    document.paint(region, 1)
    document.close()
    base_of = module.Segmenter.base

    def other(self, parameters):
        base = base_of(self, parameters)
        return type(base)(base.labels, base.n_regions, "another", ())

    monkeypatch.setattr(module.Segmenter, "base", other)
    again = Document.open(document.path)
    yield again
    again.close()


def test_regions_of_another_version_are_told_and_paint_stays(foreign):
    assert sum("This version of superfacets" in note for note in foreign.notes) == 1
    assert foreign.revision.n_regions == 20
    assert np.array_equal(np.flatnonzero(foreign.state.classes == 1), foreign.revision.cells_of(2))


def test_work_of_another_version_can_be_undone_to_its_beginning(foreign):
    for kind in ("segment", "paint", "split"):
        assert foreign.undo()[-1].kind == kind
        assert foreign.revision.n_regions == 20
    with pytest.raises(NothingError):
        foreign.undo()
    assert not foreign.state.classes.any()
    assert [foreign.redo()[-1].kind for _ in range(3)] == ["split", "paint", "segment"]
    assert np.count_nonzero(foreign.state.classes) == len(foreign.revision.cells_of(2))


def test_a_split_after_undo_is_of_the_regions_of_this_version(foreign):
    foreign.undo()
    region = foreign.revision.cells_of(3)
    foreign.split(3, foreign.revision.number, region[:1], region[-1:])
    assert foreign.revision.n_regions == 21
    labels = foreign.revision.labels
    again = reopened(foreign)
    assert np.array_equal(again.revision.labels, labels)
    again.close()


def test_a_class_that_cells_have_is_not_removed(document):
    document.paint(cells(1, 2), 3)
    with pytest.raises(
        ValueError, match="class 3 has 2 cells: give all cells of this class another class first"
    ):
        document.set_classes([{"id": 1, "name": "a"}])
    with pytest.raises(ValueError, match="there is no class 8"):
        document.paint(cells(1), 8)


def test_progress_is_the_share_of_the_area(document):
    document.paint(np.arange(document.n_cells, dtype=np.uint32), 1)
    assert document.progress == pytest.approx(1)
    half = np.flatnonzero(np.cumsum(document.areas) <= document.areas.sum() / 2)
    document.paint(half.astype(np.uint32), 0)
    assert document.progress == pytest.approx(0.5, abs=0.01)


def test_without_area_progress_is_the_share_of_cells(document):
    document.__dict__.update(areas=np.zeros(document.n_cells), _total=0.0)
    document.paint(np.arange(288, dtype=np.uint32), 1)
    assert document.progress == 0.25


def test_an_input_that_changed_under_the_work_is_refused(document):
    document.paint(cells(1), 1)
    document.close()
    write_mesh(document.path, shapes.bumpy_sheet(20))
    with pytest.raises(JournalError, match=r"sheet\.ply has changed since the work was begun"):
        Document.open(document.path)
    work = work_file_of(document.path)
    size = work.stat().st_size
    other = document.path.with_name("other.ply")
    write_mesh(other, shapes.bumpy_sheet(20))
    with pytest.raises(
        JournalError,
        match=r"the work file belongs to sheet\.ply, not to other\.ply: restore the old"
        r" file, or use another work file \(--work of superfacets studio\)",
    ):
        Document.open(other, work)
    assert work.stat().st_size == size
    write_mesh(document.path, shapes.bumpy_sheet(24))  # the old mesh
    again = Document.open(document.path)
    assert again.state.classes[1] == 1
    again.close()


def test_an_input_that_changes_while_it_is_open_stops_the_work(document):
    data = document.path.read_bytes()
    document.path.write_bytes(data + b" ")
    with pytest.raises(ChangedError, match=r"sheet\.ply has changed since the studio read it"):
        document.paint(cells(1), 1)
    with pytest.raises(ChangedError):
        document.undo()
    document.path.unlink()
    with pytest.raises(ChangedError):
        document.paint(cells(1), 1)
    document.path.write_bytes(data)  # as before
    document.paint(cells(1), 1)


def test_a_work_file_whose_first_line_lacks_what_is_needed(sheet):
    from superfacets_studio.documents.journal import Journal

    Journal.open(work_file_of(sheet), {"file": 3}).close()
    with pytest.raises(JournalError, match="the first line of the work file is damaged"):
        Document.open(sheet)


def test_undo_keeps_little_memory_for_large_strokes():
    classes = np.zeros(1_000_000, np.uint16)
    change = Change.painting(classes, np.arange(1_000_000, dtype=np.uint32), 3)
    before, after = change.before, change.after
    assert before.cells is after.cells
    assert len(after.cells) + len(before.values) + len(after.values) < 10_000


def test_new_work_is_neither_reviewed_nor_changed(document):
    assert document.state.review_marks == {}
    document.paint(cells(1), 1)
    assert document.state.review_marks == {}
    document.review(True)
    assert document.state.review_marks == {"reviewed": True}
    document.paint(cells(2), 1)
    assert document.state.review_marks == {"reviewed": True, "changed_since_review": True}
