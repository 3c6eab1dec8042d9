"""Records on the disk."""

import errno
import json
import os

import pytest

from superfacets.batches.manifest import Manifest


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
    "rest",
    [
        '{"name": "b", "ce',
        '{"name": "b"}',
        "\0\0\0\n",
        "[]\n",
        '{"cells": 3}\n',
        '{"name": "b", "outputs": 7}\n',
    ],
)
def test_a_line_that_is_cut_or_damaged_counts_for_nothing_and_goes(path, rest):
    path.write_text('{"name": "a"}\n' + rest)
    with Manifest(path) as manifest:
        assert list(manifest.records) == ["a"]
        manifest.append(record("c"))
    assert path.read_text() == '{"name": "a"}\n{"name": "c"}\n'


def test_a_later_record_replaces_an_earlier_one(path):
    write(path, record("a", cells=1), record("b"), record("a", cells=2))
    assert [json.loads(line) for line in path.read_text().splitlines()] == [
        record("a", cells=2),
        record("b"),
    ]
    with path.open("a") as file:  # as a process that was killed leaves it
        file.write('{"name": "b", "cells": 3}\n')
    with Manifest(path) as manifest:
        assert manifest.records["b"] == record("b", cells=3)
    assert len(path.read_text().splitlines()) == 2


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
