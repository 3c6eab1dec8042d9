"""Tools for developers of the package."""

import copy
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).resolve().parents[1] / "tools" / "label-hashes"
HASHES = {
    "platform": {"machine": "x86_64"},
    "meshes": {"bear5k": {"mesh": "12ab", "labels": {"k=20, defaults": "34cd", "k=20, grid": "5"}}},
}


@pytest.fixture
def compare(tmp_path):
    """Compare hashes with those above; return the exit status and the output."""

    def _compare(*others):
        paths = [tmp_path / f"{i}.json" for i in range(1 + len(others))]
        for path, hashes in zip(paths, (HASHES, *others), strict=True):
            path.write_text(json.dumps(hashes))
        done = subprocess.run(
            [sys.executable, TOOL, "compare", *paths], capture_output=True, text=True, check=False
        )
        return done.returncode, done.stdout + done.stderr

    return _compare


def test_equal_labels_of_two_platforms_pass(compare):
    other = {**HASHES, "platform": {"machine": "arm64"}}
    status, printed = compare(HASHES, other)
    assert status == 0
    assert "3 files of 2 labels each, 0 differences" in printed


def test_labels_that_differ_fail_and_are_named(compare):
    other = copy.deepcopy(HASHES)
    other["meshes"]["bear5k"]["labels"]["k=20, grid"] = "6"
    status, printed = compare(HASHES, other)
    assert status == 1
    assert "bear5k, k=20, grid: the labels differ" in printed


def test_a_mesh_or_a_run_that_is_missing_fails(compare):
    other = copy.deepcopy(HASHES)
    del other["meshes"]["bear5k"]["labels"]["k=20, grid"]
    assert compare(other)[0] == 1
    status, printed = compare({**HASHES, "meshes": {}})
    assert status == 1
    assert "bear5k: only in one of the files" in printed


def test_a_mesh_that_was_made_otherwise_is_told_apart_from_other_labels(compare):
    other = copy.deepcopy(HASHES)
    other["meshes"]["bear5k"] |= {"mesh": "12ac", "labels": {}}
    status, printed = compare(other)
    assert status == 1
    assert "bear5k: the mesh itself differs" in printed


def test_one_file_alone_proves_nothing(compare):
    status, printed = compare()
    assert status == 2
    assert "nothing was compared" in printed


def test_what_was_not_tested_is_said_in_one_line_with_the_reasons(tmp_path):
    """The tests are copied to a folder without real meshes."""
    folder = tmp_path / "checkout" / "tests"
    folder.mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("conftest.py"), folder)
    (folder / "test_some.py").write_text(
        "import pytest\n"
        "def test_one(data_dir): ...\n"
        "def test_two(benchmark_paths): ...\n"
        "def test_three(): pytest.skip('no OpenGL:\\n  install Mesa')\n"
        "def test_four(): ...\n"
    )
    environment = {name: os.environ[name] for name in os.environ if name != "SUPERFACETS_DATA"}

    def last_lines(**more):
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", folder]
        done = subprocess.run(
            command, capture_output=True, text=True, env=environment | more, cwd=folder, check=True
        )
        return done.stdout.splitlines()[-2:]

    assert last_lines()[0] == (
        "not tested: 2 tests (no real meshes: set SUPERFACETS_DATA to the folder that has them), "
        "1 test (no OpenGL: install Mesa)"
    )
    # In a folder without models, tests that would loop over them are skipped, with the reason.
    assert last_lines(SUPERFACETS_DATA=str(tmp_path))[0].startswith(
        f"not tested: 1 test (no models of the benchmark in {tmp_path / 'psb' / 'off'})"
    )
