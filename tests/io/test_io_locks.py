"""Files of ours in folders of users, and folders that one process at a time writes results to."""

import os
import subprocess
import sys

import pytest

from superfacets.io.locks import held, is_left_behind, locked, open_own


def test_a_folder_that_cannot_be_used_is_named_before_the_lock(tmp_path, monkeypatch):
    taken = tmp_path / "taken"
    taken.write_text("")
    with pytest.raises(NotADirectoryError, match="taken: is a file, not a folder"):
        locked(taken).__enter__()
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    with pytest.raises(PermissionError, match=f"{tmp_path}: the folder is not writable"):
        locked(tmp_path).__enter__()
    assert not (tmp_path / ".lock").exists()


def test_two_starts_do_not_share_a_folder(tmp_path):
    (tmp_path / ".lock").write_text("not ours")
    with (
        locked(tmp_path),
        pytest.raises(ValueError, match="another run is writing there"),
        locked(tmp_path),
    ):
        pass
    assert (tmp_path / ".lock").read_text() == "not ours"


def test_a_lock_that_was_left_is_free_and_one_that_is_held_is_not(tmp_path):
    path = tmp_path / ".lock"
    assert not is_left_behind(path)
    with held(path, "held"):
        assert not is_left_behind(path)
    assert is_left_behind(path)
    path.unlink()
    path.mkdir()
    assert not is_left_behind(path)


HOLDER = """
import subprocess, sys
from pathlib import Path
from superfacets.io.locks import locked
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


def test_a_file_system_without_locks_is_named(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError(37, "No locks available")

    monkeypatch.setattr("filelock.lock_descriptor", refuse)
    with pytest.raises(OSError, match=r"cannot be locked: No locks available: .*\.lock"):
        locked(tmp_path).__enter__()


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_name_of_ours_is_not_opened_where_it_is_no_regular_file(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "made")
    (tmp_path / "zeros").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "zeros"):
        with pytest.raises(OSError, match=f"{name}: expected a file, got a link: remove it"):
            open_own(tmp_path / name, os.O_RDWR | os.O_CREAT)
    with pytest.raises(OSError, match="pipe: is not a regular file"):
        open_own(tmp_path / "pipe", os.O_RDONLY)
    assert not (tmp_path / "made").exists()


@pytest.mark.skipif(not hasattr(os, "O_NOFOLLOW"), reason="no such flag here")
def test_a_link_that_comes_after_the_look_is_not_followed_either(tmp_path, monkeypatch):
    (tmp_path / "link").symlink_to(tmp_path / "made")
    monkeypatch.setattr("pathlib.Path.lstat", lambda _: os.stat_result([0o100644] + [0] * 9))
    with pytest.raises(OSError, match="symbolic links"):
        open_own(tmp_path / "link", os.O_RDWR | os.O_CREAT)
    assert not (tmp_path / "made").exists()
