"""The manifest of a batch, which stores records on disk."""

import errno
import json
import os

import pytest

from superfacets_batch.jobs import Manifest


def record(name, **facts):
    return {"name": name, **facts}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "manifest.jsonl"


def write(path, *records):
    with Manifest(path) as manifest:
        for each in records:
            manifest.append(each)


def test_a_record_is_on_the_disk_when_append_returns(path, monkeypatch):
    synced = []
    monkeypatch.setattr(os, "fsync", lambda _: synced.append(path.read_text()))
    with Manifest(path) as manifest:
        assert not path.exists()
        manifest.append(record("a", cells=3))
        manifest.append(record("b"))
    assert synced == ['{"name": "a", "cells": 3}\n', '{"name": "a", "cells": 3}\n{"name": "b"}\n']


def test_what_was_written_is_read_and_left_as_it_is(path):
    write(path, record("a"), record("ü\nb"))
    before = path.stat().st_mtime_ns
    with Manifest(path) as manifest:
        assert manifest.records == {"a": record("a"), "ü\nb": record("ü\nb")}
    assert path.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("rest", "is_noted"),
    [
        ('{"name": "b", "ce', False), ('{"name": "b"}', False), ("\0\0\0\n", True), ("[]\n", True),
        ('{"cells": 3}\n', True), ("[" * 200_000 + "\n", True),
        ('{"name": "b", "outputs": []}\n', True), ('{"name": "b", "outputs": null}\n', True),
        ('{"name": "b", "outputs": 5}\n', True),
    ],
)  # fmt: skip
def test_a_damaged_line_is_ignored_with_a_note_and_goes(path, rest, is_noted):
    path.write_text('{"name": "a"}\n' + rest)
    with Manifest(path) as manifest:
        assert list(manifest.records) == ["a"]
        note = f"{path}: line 2 is damaged: its input file is processed again"
        assert manifest.notes == [note] * is_noted
        manifest.append(record("c"))
    assert path.read_text() == '{"name": "a"}\n{"name": "c"}\n'


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_a_manifest_that_is_a_link_or_a_pipe_is_refused(path, tmp_path):
    path.symlink_to(tmp_path / "made")
    with pytest.raises(OSError, match=r"manifest\.jsonl: expected a file, got a link"):
        write(path, record("a"))
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(OSError, match=r"manifest\.jsonl: is not a regular file"):
        write(path, record("a"))
    assert not (tmp_path / "made").exists()


def test_a_later_record_replaces_an_earlier_one(path):
    write(path, record("a", cells=1), record("b"), record("a", cells=2))
    assert [json.loads(line) for line in path.read_text().splitlines()] == [
        record("a", cells=2),
        record("b"),
    ]
    with path.open("a") as file:  # as left by a killed process
        file.write('{"name": "b", "cells": 3}\n{"name": "c", "begun": 1}\n')
    write(path, record("c"))
    assert path.read_text().splitlines()[1:] == ['{"name": "b", "cells": 3}', '{"name": "c"}']


def test_a_full_disk_leaves_the_lines_that_are_there(path, monkeypatch):
    write(path, record("a"))
    whole = path.read_text()
    written = os.write

    def fill(file, data):
        if len(data) < 10:
            raise OSError(errno.ENOSPC, "No space left on device")
        return written(file, data[:10])

    monkeypatch.setattr(os, "write", fill)
    with pytest.raises(OSError, match=r"No space left on device: .*manifest.jsonl"):
        write(path, record("b", cells=123))
    assert path.read_text() == whole


def test_an_error_does_not_rewrite_the_file(path):
    def fail():
        with Manifest(path) as manifest:
            manifest.append(record("a", cells=1))
            manifest.append(record("a", cells=2))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert len(path.read_text().splitlines()) == 2
