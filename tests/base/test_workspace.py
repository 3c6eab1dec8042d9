"""Memory that kernels reuse, and the threads that serve one call."""

import os
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
import shapes

from superfacets import _core, build_face_graph, sample_mesh, segment

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere malloc has the memory")
N_LARGE = 300_000


def address_of_copy():
    """Return the address of a large array that is freed immediately."""
    return _core.narrow_indices(np.zeros(N_LARGE, np.int32), 1).ctypes.data


def n_threads_now():
    return len(list(Path("/proc/self/task").iterdir()))


@on_linux
def test_memory_that_was_returned_is_used_again():
    assert address_of_copy() == address_of_copy()


def test_arrays_that_are_in_use_stay_as_they_are():
    kept = [_core.narrow_indices(np.full(N_LARGE, i, np.int32), 2) for i in range(5)]
    del kept[1], kept[2]
    kept += [_core.narrow_indices(np.full(n, n, np.int32), 2) for n in (200_000, 90_000)]
    for array, value in zip(kept, (0, 2, 4, 200_000, 90_000), strict=True):
        assert (array == value).all()


@on_linux
def test_threads_end_with_the_outermost_workspace():
    mesh = shapes.bumpy_sheet(150)  # enough faces for a second thread
    before = n_threads_now()
    with _core.Workspace():
        with _core.Workspace():
            build_face_graph(mesh, n_threads=2)
        assert n_threads_now() == before + 1
        build_face_graph(mesh, n_threads=2)
        assert n_threads_now() == before + 1
    assert n_threads_now() == before


def test_a_team_is_of_use_for_fewer_and_replaced_for_more_threads():
    mesh = sample_mesh()
    expected = build_face_graph(mesh, n_threads=1)
    with _core.Workspace():
        for n_threads in (2, 3, 1, 2, 4, 3):
            graph = build_face_graph(mesh, n_threads=n_threads)
            assert np.array_equal(graph.neighbors, expected.neighbors)


def test_calls_on_several_threads_do_not_share_theirs():
    mesh = sample_mesh()
    expected = segment(mesh, 30, n_threads=1).labels
    found = []
    workers = [
        threading.Thread(target=lambda n=n: found.append(segment(mesh, 30, n_threads=n).labels))
        for n in (2, 3, 2)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(found) == 3
    assert all(np.array_equal(labels, expected) for labels in found)


def test_an_error_ends_a_workspace():
    with pytest.raises(ValueError, match="not 0"), _core.Workspace():
        raise ValueError("not 0")
    with _core.Workspace():
        assert address_of_copy()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked")
@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer aborts then")
def test_a_process_that_is_forked_within_a_call_starts_threads_of_its_own():
    mesh = sample_mesh()
    expected = build_face_graph(mesh, n_threads=2).neighbors
    with _core.Workspace(), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # about fork in a process with threads
        build_face_graph(mesh, n_threads=2)
        child = os.fork()
        if child == 0:
            same = np.array_equal(build_face_graph(mesh, n_threads=2).neighbors, expected)
            os._exit(0 if same else 1)
        assert os.waitpid(child, 0)[1] == 0
