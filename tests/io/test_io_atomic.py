"""Files that are written completely or not at all, and lock files."""

import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from superfacets.files.atomic import (
    atomic_outputs,
    locked,
    open_own,
    remove_leftovers,
    writable_folder,
)
from superfacets.files.writers.write import OutputFiles, write_labels


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def permissions(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_files_appear_when_the_block_ends(tmp_path):
    (tmp_path / "b").write_text("old")
    with atomic_outputs([tmp_path / "a", str(tmp_path / "b")]) as temporaries:
        for temporary in temporaries:
            assert temporary.parent == tmp_path
            temporary.write_text("new")
        assert (tmp_path / "b").read_text() == "old"
        assert not (tmp_path / "a").exists()
    assert names(tmp_path) == ["a", "b"]
    assert (tmp_path / "a").read_text() == (tmp_path / "b").read_text() == "new"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_nothing_changes_where_the_block_raises(tmp_path, error):
    (tmp_path / "b").write_text("old")

    def write_and_fail(temporaries):
        temporaries[0].write_text("new")
        temporaries[1].write_text("new")
        raise error

    with pytest.raises(error), atomic_outputs([tmp_path / "a", tmp_path / "b"]) as temporaries:
        write_and_fail(temporaries)
    assert names(tmp_path) == ["b"]
    assert (tmp_path / "b").read_text() == "old"


def test_a_temporary_file_that_was_taken_away_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_outputs([tmp_path / "a"]) as (temporary,):
        temporary.unlink()
    assert names(tmp_path) == []


def test_nothing_is_left_where_a_temporary_file_cannot_be_made(tmp_path, monkeypatch):
    made, touch = [], Path.touch

    def make(temporary, **options):
        made.append(temporary)
        touch(temporary, **options)
        if len(made) == 2:
            raise OSError("no space")

    monkeypatch.setattr(Path, "touch", make)
    with pytest.raises(OSError, match="no space"), atomic_outputs([tmp_path / "a", tmp_path / "b"]):
        raise AssertionError("the block must not run")
    assert len(made) == 2
    assert names(tmp_path) == []


def test_an_error_names_the_file_that_it_is_about(tmp_path):
    paths = [tmp_path / "a", str(tmp_path / "b")]

    def write_and_fail(name):
        raise OSError(28, "No space left on device", name and str(name))

    for place in (None, 0, 1):
        with pytest.raises(OSError, match="No space") as caught, atomic_outputs(paths) as found:
            write_and_fail(None if place is None else found[place])
        wanted = paths if place is None else [paths[place]]
        assert caught.value.filename == ", ".join(map(str, wanted))
    with pytest.raises(OSError, match="No space") as caught, atomic_outputs(paths):
        write_and_fail("elsewhere")
    assert caught.value.filename == "elsewhere"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such permissions")
@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path, mask):
    before = os.umask(mask)
    try:
        write_labels(tmp_path / "a.seg", [0])
        (tmp_path / "b").touch()
    finally:
        os.umask(before)
    assert permissions(tmp_path / "a.seg") == permissions(tmp_path / "b") == 0o666 & ~mask


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such permissions")
def test_a_replaced_file_keeps_its_permissions(tmp_path):
    path = tmp_path / "a.seg"
    path.touch()
    path.chmod(0o640)
    write_labels(path, [0])
    assert path.read_text() == "0\n"
    assert permissions(path) == 0o640


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_link_is_replaced_and_the_file_behind_it_is_left_alone(tmp_path):
    private = tmp_path / "private"
    private.write_text("mine")
    private.chmod(0o400)
    for name, there in (("a.seg", private), ("b.seg", tmp_path / "nothing")):
        (tmp_path / name).symlink_to(there)
        write_labels(tmp_path / name, [5])
        assert not (tmp_path / name).is_symlink()
        assert (tmp_path / name).read_text() == "5\n"
        assert permissions(tmp_path / name) & 0o200
    assert private.read_text() == "mine"
    assert not (tmp_path / "nothing").exists()


def test_names_as_long_as_can_be(tmp_path):
    path = tmp_path / ("ü" * 125 + ".seg")
    write_labels(path, [5])
    assert path.read_text() == "5\n"


@pytest.mark.parametrize(
    "call", [lambda *p: OutputFiles(p).check(), lambda p: write_labels(p, [0])]
)
def test_targets_that_cannot_be_written_are_os_errors(tmp_path, call, forbid):
    with pytest.raises(FileNotFoundError, match=r"a\.seg: the folder .*absent does not exist"):
        call(tmp_path / "absent" / "a.seg")
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match=r"a\.seg: .*file is not a folder"):
        call(tmp_path / "file" / "a.seg")
    (tmp_path / "folder.seg").mkdir()
    with pytest.raises(IsADirectoryError, match=r"folder\.seg: is a folder, not a file"):
        call(tmp_path / "folder.seg")
    forbid()  # root may write everywhere
    with pytest.raises(PermissionError, match=r"a\.seg: the folder .* is not writable"):
        call(tmp_path / "a.seg")


def test_a_folder_for_outputs_is_made_unless_a_file_is_there_or_it_is_readonly(tmp_path, forbid):
    writable_folder(tmp_path / "new" / "folder")
    writable_folder(tmp_path / "new" / "folder")
    assert (tmp_path / "new" / "folder").is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match="file: is a file, not a folder"):
        writable_folder(tmp_path / "file")
    forbid()  # root may write everywhere
    with pytest.raises(PermissionError, match="new: the folder is not writable"):
        writable_folder(tmp_path / "new")


def test_a_write_protected_file_is_an_os_error(tmp_path, forbid):
    (tmp_path / "a.seg").touch()
    forbid(lambda path, mode: path == tmp_path)
    with pytest.raises(PermissionError, match=r"a\.seg: the file is write-protected"):
        OutputFiles([tmp_path / "a.seg"]).check()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_an_os_error_and_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "a.seg")
    with pytest.raises(OSError, match=r"a\.seg: is not a regular file"):
        write_labels(tmp_path / "a.seg", [0])
    assert stat.S_ISFIFO((tmp_path / "a.seg").stat().st_mode)


def test_the_same_file_twice_is_refused(tmp_path):
    (tmp_path / "folder").mkdir()
    twice = [tmp_path / "a.seg", tmp_path / "folder" / ".." / "a.seg"]
    with pytest.raises(ValueError, match=r"a\.seg: the same output is given twice"):
        OutputFiles(twice).check()
    with pytest.raises(ValueError, match="twice"), atomic_outputs(twice):
        raise AssertionError("the block must not run")
    assert names(tmp_path) == ["folder"]


@pytest.fixture
def leftovers(tmp_path):
    """Write two temporary files of ``a.seg``, one new and one two days old."""
    new, old = (tmp_path / f".a.seg.{digit * 12}.tmp" for digit in "0f")
    for path in (new, old):
        path.write_text("half a fi")
    two_days_ago = time.time() - 2 * 24 * 3600
    os.utime(old, (two_days_ago, two_days_ago))
    return new, old


def test_what_a_killed_writer_left_is_removed_a_day_later(tmp_path, leftovers):
    new, old = leftovers
    write_labels(tmp_path / "b.seg", [0])
    assert old.exists()
    write_labels(tmp_path / "a.seg", [0])
    assert not old.exists()
    assert new.exists()
    remove_leftovers([tmp_path / "a.seg", tmp_path / "absent" / "a.seg"], older_than=0.0)
    assert names(tmp_path) == ["a.seg", "b.seg"]


def test_what_looks_like_a_leftover_and_is_none_stays(tmp_path):
    kept = [".a.seg.tmp", ".a.seg.0123.tmp", ".a.seg.0123456789AB.tmp", ".a.npy.0123456789ab.tmp"]
    for name in kept:
        (tmp_path / name).write_text("somebody's")
    (tmp_path / ".a.seg.0123456789ab.tmp").mkdir()
    remove_leftovers([tmp_path / "a.seg"], older_than=0.0)
    assert names(tmp_path) == sorted([*kept, ".a.seg.0123456789ab.tmp"])


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_link_that_looks_like_a_leftover_stays(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / ".a.seg.0123456789ab.tmp").symlink_to(tmp_path / "file")
    remove_leftovers([tmp_path / "a.seg"], older_than=0.0)
    assert names(tmp_path) == [".a.seg.0123456789ab.tmp", "file"]


def test_a_leftover_that_another_writer_removes_first_is_no_error(tmp_path, leftovers, monkeypatch):
    tried = []

    def gone(path):
        tried.append(path)
        raise FileNotFoundError(path)

    monkeypatch.setattr(Path, "unlink", gone)
    remove_leftovers([tmp_path / "a.seg"], older_than=0.0)
    assert sorted(tried) == sorted(leftovers)


def test_a_folder_that_cannot_be_used_is_named_before_the_lock(tmp_path, forbid):
    taken = tmp_path / "taken"
    taken.write_text("")
    with pytest.raises(NotADirectoryError, match="taken: is a file, not a folder"):
        locked(taken).__enter__()
    forbid()  # root may write everywhere
    with pytest.raises(PermissionError, match=f"{tmp_path}: the folder is not writable"):
        locked(tmp_path).__enter__()
    assert not (tmp_path / ".lock").exists()


def test_two_starts_do_not_share_a_folder(tmp_path):
    (tmp_path / ".lock").write_text("not ours")
    with (
        locked(tmp_path),
        pytest.raises(ValueError, match="another run is writing to this folder"),
        locked(tmp_path),
    ):
        pass
    assert (tmp_path / ".lock").read_text() == "not ours"


HOLDER = """
import subprocess, sys
from pathlib import Path
from superfacets.files.atomic import locked
with locked(Path(sys.argv[1])):
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    print("held", flush=True)
    input()
"""


def test_a_lock_ends_with_its_process_though_a_child_lives_on(tmp_path):
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(ValueError, match="another run"):
            locked(tmp_path).__enter__()
        holder.kill()
        holder.wait()
        with locked(tmp_path):
            pass


def test_a_file_system_without_locks_is_named(tmp_path, broken):
    broken("filelock.lock_descriptor", OSError(37, "No locks available"))
    with pytest.raises(OSError, match=r"cannot be locked: No locks available: .*\.lock"):
        locked(tmp_path).__enter__()


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_name_of_ours_is_not_opened_where_it_is_no_regular_file(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "made")
    (tmp_path / "zeros").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "zeros"):
        with pytest.raises(OSError, match=f"{name}: expected a file, got a link: remove the link"):
            open_own(tmp_path / name, os.O_RDWR | os.O_CREAT)
    with pytest.raises(OSError, match="pipe: is not a regular file"):
        open_own(tmp_path / "pipe", os.O_RDONLY)
    assert not (tmp_path / "made").exists()


def test_a_file_of_our_own_can_be_locked_until_it_is_closed(tmp_path):
    path, flags = tmp_path / "journal", os.O_RDWR | os.O_CREAT
    file = open_own(path, flags, "busy")
    with pytest.raises(ValueError, match=r"^busy$"):
        open_own(path, flags, "busy")
    os.close(file)
    os.close(open_own(path, flags, "busy"))


@pytest.mark.skipif(not hasattr(os, "O_NOFOLLOW"), reason="no such flag here")
def test_a_link_that_comes_after_the_look_is_not_followed_either(tmp_path, monkeypatch):
    (tmp_path / "link").symlink_to(tmp_path / "made")
    monkeypatch.setattr("pathlib.Path.lstat", lambda _: os.stat_result([0o100644] + [0] * 9))
    with pytest.raises(OSError, match="symbolic links"):
        open_own(tmp_path / "link", os.O_RDWR | os.O_CREAT)
    assert not (tmp_path / "made").exists()
