"""Tools for developers of the package."""

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


@pytest.mark.parametrize(
    ("change", "status", "message"),
    [
        ({}, 0, "3 files of 2 labels each, 0 differences"),
        ({"labels": {"k=20, defaults": "34cd", "k=20, grid": "6"}}, 1,
         "bear5k, k=20, grid: the labels differ"),
        ({"labels": {"k=20, defaults": "34cd"}}, 1, "k=20, grid"),
        ({"mesh": "12ac", "labels": {}}, 1, "bear5k: the mesh itself differs"),
    ],
)  # fmt: skip
def test_labels_of_two_platforms_are_equal_or_named(compare, change, status, message):
    model = HASHES["meshes"]["bear5k"] | change
    other = {"platform": {"machine": "arm64"}, "meshes": {"bear5k": model}}
    found, printed = compare(HASHES, other)
    assert (found, message in printed) == (status, True), printed


def test_files_of_other_meshes_and_one_file_alone_prove_nothing(compare):
    status, printed = compare({**HASHES, "meshes": {}})
    assert (status, "bear5k: only in one of the files" in printed) == (1, True)
    status, printed = compare()
    assert (status, "nothing was compared" in printed) == (2, True)


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


def test_slow_tests_exist():
    for line in (TOOL.parent / "slow-tests.txt").read_text().splitlines():
        path, name = line.removeprefix("--deselect=").split("::")
        assert f"def {name}(" in (TOOL.parents[1] / path).read_text(), line
