"""The line on a terminal that shows progress."""

import os
import pty
import subprocess
import sys
import termios
import time

import numpy as np
import pytest
from command_line import IMPATIENT

from superfacets.kit import OutputFiles
from superfacets_cli.interrupts import is_busy, run_in_background
from superfacets_cli.progress import Progress


def test_a_terminal_shows_stages_and_seconds(capsys, terminal, limit, monkeypatch):
    terminal(sys.stderr)
    monkeypatch.setattr(Progress, "STEP", 0.02)
    limit("delay of the bar", 0.02)
    with Progress("a.ply") as bar:
        for stage, n_iter in (("mesh", 0), ("face_graph", 0), ("classify", 3)):
            bar.on_report(stage, n_iter)
            time.sleep(0.1)
    shown = capsys.readouterr().err
    for text in ("a.ply: reading, 0 s", "a.ply: face graph, 0 s", "a.ply: iteration 3, 0 s"):
        assert text in shown
    assert shown.endswith("\033[K")  # the line is cleared


def test_a_pipe_shows_no_progress_bar_and_a_terminal_does(large, tmp_path):
    command = [*IMPATIENT, "segment", str(large), "-o", str(tmp_path / "labels.npy")]
    piped = subprocess.run(command, capture_output=True, text=True, check=True)
    assert piped.stderr == ""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=theirs, timeout=60)
    os.set_blocking(ours, False)  # all output has been written by now
    with os.fdopen(ours, "rb", buffering=0) as reader:
        shown = reader.read()
    os.close(theirs)
    assert b"iteration " in shown


def test_nothing_is_drawn_where_stderr_is_no_terminal(capsys):
    with Progress("a.ply") as bar:
        bar.on_report("mesh")
    assert capsys.readouterr().err == ""


def test_work_in_the_background_returns_or_raises():
    assert run_in_background(lambda: 42) == 42

    def fail():
        raise TimeoutError("not the waiting's own")

    with pytest.raises(TimeoutError, match="not the waiting's own"):
        run_in_background(fail)
    assert not is_busy()


def test_a_terminal_shows_that_silent_work_goes_on(limit, capsys, terminal):
    terminal(sys.stderr)
    limit("delay of the bar", 0.1)
    run_in_background(lambda: time.sleep(0.3))
    assert "working, 0 s" in capsys.readouterr().err
    run_in_background(lambda: time.sleep(0.05))
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("command", ["convert", "transfer"])
def test_a_terminal_shows_that_long_writing_goes_on(run, sheet, monkeypatch, command):
    write = OutputFiles.write

    def write_slowly(*arguments, **options):
        time.sleep(0.3)
        return write(*arguments, **options)

    np.save(sheet.with_name("a.npy"), np.zeros(1152, np.int32))
    goal = [sheet] if command == "transfer" else []
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(Progress, "DELAY", 0.2)
    monkeypatch.setattr(OutputFiles, "write", write_slowly)
    arguments = (command, sheet, sheet.with_name("a.npy"), *goal, "-o", sheet.with_name("b.ply"))
    assert "working, 0 s" in run(*arguments)[2]
    assert "working" not in run(*arguments, "--quiet")[2]
