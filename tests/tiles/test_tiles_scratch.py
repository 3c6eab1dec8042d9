"""Arrays on disk: complete or absent, and removed with the run, however it ends."""

import errno
import os
import shutil
import subprocess
import sys
import time
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from tiled_checks import largest_file

from superfacets.workers.scratch import check_room, scratch_folder


@pytest.fixture
def folder(tmp_path):
    with scratch_folder(tmp_path / "scratch") as made:
        yield made


@pytest.mark.parametrize("dtype", ["f8", "f4", "i4", "i8", "u4", "u1"])
@pytest.mark.parametrize("shape", [(10,), (10, 3), (10, 3, 3), (0, 3)])
def test_ranges_of_rows_are_those_of_the_array(folder, dtype, shape):
    array = np.arange(np.prod(shape)).reshape(shape).astype(dtype)
    folder.save("a/b", array)
    assert np.array_equal(np.load(folder.folder / "a" / "b.npy"), array)
    assert np.array_equal(folder.load("a/b"), array)
    n = len(array)
    for begin, end in [(0, n // 2), (n // 2, n), (n, n)]:
        found = folder.load("a/b", begin, end)
        assert found.dtype == array.dtype
        assert np.array_equal(found, array[begin:end])


def test_arrays_are_read_without_ast(folder, monkeypatch):
    """In CPython 3.11, `ast` fails if threads use it at the same time."""

    def fail(text):
        raise SystemError("AST constructor recursion depth mismatch")

    monkeypatch.setattr("ast.literal_eval", fail)
    folder.save("a", np.arange(7))
    assert folder.load("a", 5).tolist() == [5, 6]


def test_an_array_that_is_written_again_is_replaced_and_one_removed_is_gone(folder):
    folder.save("a", np.arange(5))
    folder.save("a", np.arange(3))
    folder.save("deep/b", np.arange(2))
    assert folder.load("a").tolist() == [0, 1, 2]
    folder.remove("a")
    folder.remove_folder("deep")
    assert not folder.has("a")
    assert not folder.has("deep/b")
    folder.remove("a")


def on_disk(made):
    return sorted(path.name for path in made.folder.iterdir() if path.suffix == ".npy")


def test_arrays_stay_in_memory_while_there_is_room(tmp_path):
    with scratch_folder(tmp_path, 100) as made:
        made.save("a", np.arange(10))
        made.save("b", np.arange(10, 20))
        assert on_disk(made) == ["b.npy"]
        made.remove("a")
        assert not made.has("a")
        made.save("b", np.arange(5, 15))  # now there is space for it
        assert on_disk(made) == []
        made.save("b", np.arange(100))
        assert on_disk(made) == ["b.npy"]
        assert made.load("b", 98).tolist() == [98, 99]
        made.save("c/d", np.arange(10))
        assert made.has("c/d")
        assert made.load("c/d", 3, 5).tolist() == [3, 4]
        made.remove_folder("c")
        assert not made.has("c/d")
        made.save("e", np.arange(10))  # in the space of that
        assert on_disk(made) == ["b.npy"]


def test_what_is_kept_in_memory_or_not_at_all(tmp_path):
    with scratch_folder(tmp_path, 100) as made:
        made.save("a", np.arange(20))
        assert made.keep("a", np.arange(5))
        assert made.load("a").tolist() == list(range(5))
        assert not made.keep("b", np.arange(10))
        assert not made.has("b")
        assert on_disk(made) == []


def test_arrays_in_memory_cannot_be_changed(tmp_path):
    with scratch_folder(tmp_path, 1000) as made:
        array = np.arange(10)
        made.save("a", array)
        made.save("part", np.arange(20)[::2])
        for changed in (array, made.load("a"), made.load("a", 3), made.load("part")):
            with pytest.raises(ValueError, match="read-only"):
                changed[0] = 1
        assert made.load("part").tolist() == list(range(0, 20, 2))
        assert made.load("part").base.nbytes == 80  # not the whole array it was a part of


def test_a_file_that_cannot_be_written_is_named_and_leaves_nothing(folder):
    with largest_file(1_000), pytest.raises(OSError, match=r"File too large: '.*a\.npy'") as caught:
        folder.save("a", np.arange(500))
    assert caught.value.errno == errno.EFBIG
    assert [path.name for path in folder.folder.iterdir()] == [".lock"]


def test_a_file_that_became_shorter_is_an_error(folder):
    folder.save("a", np.arange(100))
    path = folder.folder / "a.npy"
    os.truncate(path, path.stat().st_size - 8)
    with pytest.raises(OSError, match="the file became shorter while it was read"):
        folder.load("a")


def test_a_folder_is_removed_after_errors_too(tmp_path):
    class Failure(BaseException):
        pass

    def fail(error):
        with scratch_folder(tmp_path) as made:
            made.save("a", np.arange(5))
            raise error

    for error in (Failure, KeyboardInterrupt, OSError):
        with pytest.raises(error):
            fail(error)
        assert list(tmp_path.iterdir()) == []


def test_a_folder_is_removed_though_ctrl_c_comes_meanwhile(tmp_path, monkeypatch):
    whole, interrupts = shutil.rmtree, [KeyboardInterrupt, KeyboardInterrupt]

    def remove(*args, **options):
        if interrupts:
            raise interrupts.pop()
        whole(*args, **options)

    monkeypatch.setattr(shutil, "rmtree", remove)
    with pytest.raises(KeyboardInterrupt), scratch_folder(tmp_path) as made:
        made.save("a", np.arange(5))
    assert list(tmp_path.iterdir()) == []


def test_too_little_room_is_told_before_any_work(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(10**12, 10**12, 3 * 10**9))
    message = "the disk has 3.0 GB free, but about 5.0 GB are needed: choose a scratch folder"
    with pytest.raises(OSError, match=message):
        check_room(tmp_path, 5 * 10**9)
    check_room(tmp_path, 3 * 10**9)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(10**12, 10**12, 2 * 10**6))
    with pytest.raises(OSError, match=r"has 2\.0 MB free, but about 15\.0 MB are needed"):
        check_room(tmp_path, 15 * 10**6)


SCRIPT = """
import sys, time
from pathlib import Path
import numpy as np
from superfacets.workers.scratch import scratch_folder
with scratch_folder(Path(sys.argv[1])) as made:
    made.save("a", np.arange(5))
    print(made.folder, flush=True)
    time.sleep(60)
"""


@pytest.mark.skipif(os.name == "nt", reason="no pipes and links there")
def test_a_folder_whose_lock_is_a_pipe_or_a_link_is_left_alone(tmp_path):
    private = tmp_path / "private"
    private.touch()
    folders = [tmp_path / f".superfacets-tiles-{number:012x}" for number in (1, 2)]
    for folder in folders:
        folder.mkdir()
    os.mkfifo(folders[0] / ".lock")
    (folders[1] / ".lock").symlink_to(private)
    with scratch_folder(tmp_path):
        assert all(folder.exists() for folder in folders)


def test_what_a_killed_run_left_is_removed_by_the_next_and_nothing_else(tmp_path):
    others = [".superfacets-tiles-x", ".superfacets-tiles-0123456789abcdef", "mine"]
    for name in others:
        (tmp_path / name).mkdir()
    unlocked = tmp_path / ".superfacets-tiles-0123456789ab"
    unlocked.mkdir()  # no run has ever locked it
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    left = process.stdout.readline().strip()
    with scratch_folder(tmp_path):
        assert Path(left).exists()  # that run is still active
    process.kill()
    process.communicate()
    deadline = time.monotonic() + 10
    while Path(left).exists() and time.monotonic() < deadline:
        with scratch_folder(tmp_path):
            pass
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*others, unlocked.name])
