"""Threads of the caller: calls of the core share no state, with a GIL and without."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
import shapes

from superfacets import Mesh, build_face_graph, crease_weights, segment, segment_graph
from superfacets.base.checks import MAX_THREADS_PER_CORE, checked_threads, usable_cores

N_CALLERS = 4


def at_once(work):
    """Return the results of N_CALLERS threads that call `work` at the same moment."""
    barrier = Barrier(N_CALLERS)

    def wait_and_work(caller):
        barrier.wait(timeout=60)
        return work(caller)

    with ThreadPoolExecutor(N_CALLERS) as pool:
        return list(pool.map(wait_and_work, range(N_CALLERS)))


@pytest.fixture(scope="module")
def sheet():
    return shapes.bumpy_sheet(48)


def test_several_threads_may_segment_one_mesh_at_once(sheet):
    alone = segment(sheet, 30).labels
    for result in at_once(lambda _: segment(sheet, 30)):
        assert np.array_equal(result.labels, alone)


def test_several_threads_may_segment_one_graph_that_none_has_used_before(sheet):
    faces = build_face_graph(sheet)
    weights = crease_weights(sheet, faces, 0.1)
    alone = segment_graph(faces.with_weights(weights), 30).labels
    graph = faces.with_weights(weights)
    for result in at_once(lambda _: segment_graph(graph, 30)):
        assert np.array_equal(result.labels, alone)


def test_errors_of_one_thread_do_not_reach_another(sheet):
    broken = np.array(sheet.vertices)
    broken[7, 1] = np.nan

    def segment_or_fail(caller):
        if caller % 2:
            with pytest.raises(ValueError, match=r"vertices\[7\]"):
                Mesh(broken, sheet.faces)
            return None
        return segment(sheet, 30).labels

    alone = segment(sheet, 30).labels
    for labels in at_once(segment_or_fail)[::2]:
        assert np.array_equal(labels, alone)


def test_a_team_is_no_larger_than_cores_have_use_for(monkeypatch):
    """On two cores, 1,024 threads took four times as long as two."""
    most = MAX_THREADS_PER_CORE * usable_cores()
    assert checked_threads(10**9) == most < 1024 * usable_cores()
    assert checked_threads(1) == 1
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "1000000")
    assert checked_threads(None) == most
    monkeypatch.delenv("SUPERFACETS_NUM_THREADS")
    assert checked_threads(None) == usable_cores()
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {7}, raising=False)
    assert checked_threads(None) == 1
