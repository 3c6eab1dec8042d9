"""The finished fraction of a run, and the progress bar."""

import os
import pty
import re
import subprocess
import sys
import termios
import time

import numpy as np
import pytest
import shapes
from command_line import COMMAND

from superfacets import segment
from superfacets.kit import OutputFiles
from superfacets_cli.interrupts import is_busy, run_in_background
from superfacets_cli.progress import SHARES, Estimate, RunBar, WaitBar


def test_a_terminal_shows_progress(run, sheet, terminal):
    terminal(sys.stderr)
    status, out, err = run("segment", sheet)
    assert status == 0
    for stage in ("reading", "face graph", "seeding", "iterations", "regions", "writing"):
        assert f"{sheet}: {stage}" in err
        assert f"{sheet}: {stage}" not in out
    shares = [int(share) for share in re.findall(r"(\d+)% \|", err)]
    assert shares == sorted(shares)
    assert shares[-1] == 88  # everything except writing


def test_a_pipe_shows_no_progress_bar_and_a_terminal_does(large, tmp_path):
    command = [*COMMAND, "segment", str(large), "-o", str(tmp_path / "labels.npy")]
    piped = subprocess.run(command, capture_output=True, text=True, check=True)
    assert piped.stderr == ""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=theirs, timeout=60)
    os.set_blocking(ours, False)  # all output has been written by now
    shown = os.read(ours, 100_000).decode()
    os.close(theirs)
    os.close(ours)
    assert "iterations" in shown


def test_shares_add_up_and_are_of_the_stages_that_runs_report():
    assert sum(SHARES.values()) == pytest.approx(1.0)
    seen = []
    segment(shapes.bumpy_sheet(8), 10, callback=lambda stage, *_: seen.append(stage))
    assert list(dict.fromkeys(seen)) == [stage for stage in SHARES if stage != "export"]


def test_an_estimate_never_falls_and_ends_below_one():
    estimate = Estimate(100.0)
    fractions = [estimate.fraction(100.0), estimate.fraction(107.0)]
    assert fractions == [0.0, 0.0]  # there is no earlier stage to compare with
    now = 110.0
    for stage in SHARES:
        estimate.begin(stage, now)
        for part in range(5):
            estimate.iterate(4 * part)
            fractions.append(estimate.fraction(now + part))
        now += 5.0
    assert fractions == sorted(fractions)
    assert 0.95 < fractions[-1] < 1.0


def test_an_estimate_moves_by_time_within_a_stage_and_by_iterations_in_the_loop():
    estimate = Estimate(0.0)
    estimate.begin("face_graph", 3.0)  # the first 6 % took 3 seconds: these 15 % will take 7.5
    assert estimate.fraction(3.0) == pytest.approx(0.06)
    assert estimate.fraction(6.0) == pytest.approx(0.06 + 0.4 * 0.15)
    assert estimate.fraction(60.0) == pytest.approx(0.06 + 0.95 * 0.15)
    estimate.begin("mesh", 61.0)  # an earlier stage
    assert estimate.stage == "face_graph"
    estimate.begin("classify", 70.0)
    assert estimate.fraction(99.0) == pytest.approx(0.6)
    estimate.iterate(8)
    assert estimate.fraction(99.0) == pytest.approx(0.6 + 0.2 * (1 - np.exp(-1)))


def test_nothing_is_drawn_where_stderr_is_no_terminal(capsys):
    with RunBar("a.ply") as bar:
        bar.on_report("mesh")
        bar.draw()
    assert capsys.readouterr().err == ""


def test_work_in_the_background_returns_or_raises():
    ticks = []
    assert run_in_background(lambda: 42) == 42
    assert run_in_background(lambda: time.sleep(0.35), tick=lambda: ticks.append(1)) is None
    assert len(ticks) >= 2

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
    monkeypatch.setattr(WaitBar, "DELAY", 0.2)
    monkeypatch.setattr(OutputFiles, "write", write_slowly)
    arguments = (command, sheet, sheet.with_name("a.npy"), *goal, "-o", sheet.with_name("b.ply"))
    assert "working, 0 s" in run(*arguments)[2]
    assert "working" not in run(*arguments, "--quiet")[2]
