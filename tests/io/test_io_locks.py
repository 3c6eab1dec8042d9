"""Folders that one process at a time writes results to."""

import os

import pytest

from superfacets.io.locks import locked


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
    pytest.importorskip("fcntl")
    (tmp_path / ".lock").write_text("not ours")
    with (
        locked(tmp_path),
        pytest.raises(ValueError, match="another run is writing there"),
        locked(tmp_path),
    ):
        pass
    assert (tmp_path / ".lock").read_text() == "not ours"
