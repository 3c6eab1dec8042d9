"""The search for bad inputs notices all kinds of failures, and says how to repeat them."""

import json
import os
import random
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from superfacets import Mesh

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / room) for room in ("io",)]  # as tools/fuzz does

from tools.fuzzing.command import KINDS, Search  # noqa: E402 - found along the path above
from tools.fuzzing.files import odd_document  # noqa: E402
from tools.fuzzing.promises import check_labels, check_pieces, refusals  # noqa: E402


class _Bad(Search):
    """Cases that fail in every way."""

    def run_case(self, number, folder):
        if number == 1:
            os.abort()
        if number == 2:
            time.sleep(60)
        if number == 3:
            bytes(8 << 30)
        assert number != 4, "it is wrong"


@pytest.fixture(scope="module")
def failures():
    """Run cases 0 to 5, each for at most 2 seconds, and return the failure of each, or None."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(KINDS, "graphs", KINDS["graphs"]._replace(seconds=2.0))
        return dict(_Bad(0, ("graphs",), ()).outcomes(iter(range(6)), 2))


def test_a_case_that_crashes_hangs_or_is_wrong_is_a_failure(failures):
    assert failures[0] is failures[5] is None
    assert failures[1].startswith("the process ended")
    assert failures[2] == "it did not end within 2 seconds"
    assert "AssertionError: it is wrong" in failures[4]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not heed the limit")
def test_a_case_that_takes_too_much_memory_is_a_failure(failures):
    assert "MemoryError" in failures[3]


def test_errors_that_nobody_meant_are_failures():
    with refusals():
        Mesh([[0, 0, 0]], [[0, 0, 7]])
    with pytest.raises(ValueError, match="zero-size"), refusals():
        np.zeros(0).max()
    with pytest.raises(ZeroDivisionError), refusals():
        raise ZeroDivisionError


def test_labels_that_break_a_promise_are_failures():
    graph = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2], [0, 0, 3]])
    for labels in ([0, 2], [0, 0, 1], np.array([0, 1])):
        with pytest.raises(AssertionError):
            check_labels(labels, 2, 2)
    check_labels(np.array([1, 0], np.int32), 2, 2)
    from superfacets import build_face_graph

    with pytest.raises(AssertionError):
        check_pieces([0, 0], build_face_graph(graph))


def run_fuzz(*words):
    command = [sys.executable, str(ROOT / "tools" / "fuzz"), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_some_search_finds_nothing():
    done = run_fuzz("--cases", "60", "--jobs", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.fullmatch(r"seed 0: 60 cases \(.*\) in \d+ s, 0 failed\n", done.stdout)


def test_a_case_can_be_run_again():
    done = run_fuzz("--seed", "3", "--case", "6", "--only", "graphs", "cells")
    assert done.returncode == 0, done.stderr
    assert re.match(r"case 6, (graphs|cells): its files are in ", done.stdout)


def test_documents_stay_small_whatever_is_repeated():
    source = random.Random(1)
    documents = (odd_document({"a": [[[[0, 0, 0]]]]}, source) for _ in range(2000))
    assert 10**5 < max(len(json.dumps(document)) for document in documents) < 10**7


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_no_region_loses_its_last_cell_whatever_limits_its_size():
    search = Search(1, ("sizes",), ())
    for number in range(500):
        search.run_case(number, Path())
