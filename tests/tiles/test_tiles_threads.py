"""Several tiles at a time on threads of one process: equal labels, and no files left."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from tiled_checks import compare, in_memory

import superfacets as sf
from superfacets import PointCloud
from superfacets._options import LoopOptions
from superfacets.batches.mapping import open_run
from superfacets.tiles import segmenting
from superfacets.tiles.segmenting import Place
from superfacets.workers import threads
from superfacets.workers.scratch import scratch_folder


@pytest.fixture(scope="module")
def bear():
    return sf.sample_mesh(20_000)


@pytest.mark.parametrize("cache", [0, 1 << 20, 1 << 30])
@pytest.mark.parametrize("n_threads", [1, 2, 8])
def test_labels_do_not_depend_on_threads(bear, tmp_path, n_threads, cache):
    cloud = PointCloud(bear.vertices)
    for cells in (bear, cloud):
        options = {"tile_size": 4096, "scratch": tmp_path, "cache": cache}
        found = sf.segment_tiled(cells, 40, n_threads=n_threads, **options)
        compare(found, in_memory(cells, 40))
    assert not list(tmp_path.iterdir())


def loop_of(n_threads):
    return LoopOptions.checked(5, 0.02, None, "keep", n_threads, None)


@pytest.mark.parametrize(
    ("memory", "limit", "expected"),
    [(1 << 40, None, 4), (1 << 20, None, 1), (16 * 500 * 4096, None, 2), (1 << 30, 1 << 30, 1)],
)
def test_tiles_at_the_same_time_fit_into_memory(monkeypatch, tmp_path, memory, limit, expected):
    monkeypatch.setattr(segmenting, "memory_of_process", lambda: memory)
    monkeypatch.setattr(segmenting, "address_limit", lambda: limit)
    monkeypatch.setattr("superfacets._validate.usable_cores", lambda: 8)
    place = Place(4096, tmp_path, 0, (), 1, None)
    assert place.tiles_at_once(loop_of(4)) == expected


class Slow:
    """Work that is slow and records what is done."""

    def __init__(self):
        self.n_begun = self.n_done = 0

    def __call__(self, scratch, piece, seconds):
        self.n_begun += 1
        if piece == 1:
            raise ValueError("piece 1")
        time.sleep(seconds)
        scratch.save(f"late/{piece}", np.arange(3))
        self.n_done += 1


def test_an_error_leaves_no_piece_waiting(tmp_path):
    slow = Slow()
    with (
        pytest.raises(ValueError, match="piece 1"),
        scratch_folder(tmp_path) as scratch,
        open_run(1, None, tmp_path, 2) as run,
    ):
        run.all(slow, scratch, 1_000, 0.01)
    assert slow.n_begun - 1 == slow.n_done < 900
    assert not list(tmp_path.iterdir())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("n_times", [1, 2])
def test_ctrl_c_waits_for_what_is_at_work(tmp_path, monkeypatch, n_times):
    slow, has_begun, is_ending = Slow(), threading.Event(), threading.Event()
    wait = threads.ThreadTeam._wait

    def wait_and_tell(team):
        is_ending.set()
        wait(team)

    def work(scratch, piece, seconds):
        if piece == 0:
            has_begun.wait(60)
            while not is_ending.is_set():  # in callbacks of weak references Python drops interrupts
                os.kill(os.getpid(), signal.SIGINT)
                is_ending.wait(5)
        else:
            has_begun.set()
            is_ending.wait(60)
            if n_times == 2:
                time.sleep(0.05)  # so that the callbacks of the first interrupt have ended
                os.kill(os.getpid(), signal.SIGINT)
        slow(scratch, piece + 2, seconds)

    monkeypatch.setattr(threads.ThreadTeam, "_wait", wait_and_tell)
    with (
        pytest.raises(KeyboardInterrupt),
        scratch_folder(tmp_path) as scratch,
        open_run(1, None, tmp_path, 2) as run,
    ):
        run.all(work, scratch, 100, 0.2)
    assert slow.n_begun == slow.n_done < 10
    assert not list(tmp_path.iterdir())


def test_no_room_for_a_thread_is_no_room_in_memory(tmp_path, monkeypatch):
    def refuse(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    with (
        pytest.raises(MemoryError, match="cannot start 2 threads"),
        open_run(1, None, tmp_path, 2),
    ):
        pass


def test_other_errors_of_the_same_kind_are_passed_on(tmp_path):
    def fail(scratch, piece):
        raise RuntimeError(f"piece {piece}")

    with pytest.raises(RuntimeError, match="piece 0"), open_run(1, None, tmp_path, 2) as run:
        run.all(fail, None, 5)


def test_nothing_is_written_once_the_folder_is_gone(tmp_path):
    with scratch_folder(tmp_path) as scratch:
        scratch.save("a/b", np.arange(3))
    with pytest.raises(FileNotFoundError):
        scratch.save("a/b", np.arange(3))
    assert not list(tmp_path.iterdir())
