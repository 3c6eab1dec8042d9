"""The search for bad inputs notices what it is there to notice, and shows how to see it again."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tools.fuzzing.pool import Worker
from tools.fuzzing.promises import check_labels, check_pieces, refusals

from superfacets import Mesh

ROOT = Path(__file__).resolve().parents[1]

SERVANT = """
import os, sys, time
sys.path.insert(0, sys.argv[1])
from fuzzing.pool import serve
def run(number):
    if number == 1: os.abort()
    if number == 2: time.sleep(60)
    if number == 3: bytes(8 << 30)
    print("not an answer")
    return "it is wrong" if number == 4 else None
serve(run)
"""


@pytest.fixture
def worker():
    command = [sys.executable, "-c", SERVANT, str(ROOT / "tools")]
    worker = Worker(command, seconds_per_case=5)
    yield worker
    worker.stop()


def test_a_case_that_crashes_hangs_or_takes_all_memory_is_a_failure(worker):
    assert worker.run(0) is None
    assert worker.run(1).startswith("the process ended with status")
    assert worker.run(2).startswith("it did not end within 5 seconds")
    assert worker.run(4) == "it is wrong"
    assert worker.run(0) is None


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not heed the limit")
def test_a_case_that_takes_too_much_memory_is_a_failure(worker):
    failure = worker.run(3)
    assert failure.startswith("the process ended with status")
    assert "MemoryError" in failure


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


def test_a_second_of_search_finds_nothing():
    command = [sys.executable, str(ROOT / "tools" / "fuzz"), "--seconds", "1", "--jobs", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.fullmatch(r"seed 0: \d+ cases \(.*\), 0 failed\n", done.stdout)


def test_a_case_can_be_run_again():
    command = [sys.executable, str(ROOT / "tools" / "fuzz"), "--seed", "3", "--case", "6"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.startswith("case 6 is a graph; its files are in ")
