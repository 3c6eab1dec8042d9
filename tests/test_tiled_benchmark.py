"""The measurement of runs in tiles, and the simulation of larger ones."""

import json
import re
import sys

import pytest
from benchmarks.tiled import Cluster, Measured, Pass, commands, simulate
from click.testing import CliRunner

from superfacets import sample_mesh, write_mesh

FREE = {"bandwidth": 1e12, "shared": 1e15, "dispatch": 0.0}
"""A cluster on which only processor time counts."""


def measured(*passes, driver=0.0, halo=0.0):
    return Measured(1_000, 10, 100, 1, list(passes), {"regions": driver}, 1.0, halo)


def test_tiles_are_shared_by_workers_and_the_driver_is_not():
    run = measured(Pass("work", 10, 10, 2e-3, 0.0, 0.0, 1.0), driver=1e-3)
    for workers, in_passes in [(1, 2.0), (2, 1.0), (3, 0.8), (10, 0.2), (99, 0.2)]:
        total, driver = simulate(run, 1_000, 100, Cluster(workers, **FREE))
        assert (total, driver) == pytest.approx((in_passes + 1.0, 1.0), rel=1e-6)
    total, driver = simulate(run, 10_000, 100, Cluster(4, **FREE))
    assert (total, driver) == pytest.approx((20.0 / 4 + 10.0, 10.0), rel=1e-6)


def test_bytes_take_their_time_and_what_is_shared_is_divided():
    run = measured(Pass("work", 10, 10, 0.0, 600.0, 400.0, 1.0))  # a million bytes
    alone = Cluster(1, bandwidth=1e6, shared=1e9, dispatch=0.0)
    crowded = Cluster(10, bandwidth=1e6, shared=2e6, dispatch=0.0)
    assert simulate(run, 1_000, 100, alone)[0] == pytest.approx(1.0)
    assert simulate(run, 1_000, 100, crowded)[0] == pytest.approx(0.5)


def test_tiles_are_handed_out_one_after_the_other():
    run = measured(Pass("work", 10, 10, 0.0, 0.0, 0.0, 1.0))
    assert simulate(run, 1_000, 100, Cluster(50, 1e12, 1e15, dispatch=0.25))[0] == 2.5


def test_halos_of_smaller_tiles_are_more_work():
    run = measured(Pass("work", 10, 10, 1e-3, 0.0, 0.0, 1.0), halo=0.1)
    assert simulate(run, 1_000, 100, Cluster(1, **FREE))[0] == pytest.approx(1.0)
    smaller = simulate(run, 1_000, 25, Cluster(1, **FREE))[0]
    assert smaller == pytest.approx(1.2 / 1.1)


@pytest.mark.skipif(sys.platform != "linux", reason="bytes are counted by Linux")
def test_a_run_is_measured_and_planned_with(tmp_path, monkeypatch):
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "1")
    write_mesh(tmp_path / "bear.ply", sample_mesh(20_000))
    output = tmp_path / "measured.json"
    words = ["measure", str(tmp_path / "bear.ply"), "-o", str(output), "--tile-size", "4096"]
    done = CliRunner().invoke(commands, [*words, "-n", "30", "--workers", "1"])
    assert done.exit_code == 0, done.output
    (run,) = json.loads(output.read_text())
    names = [of_pass["name"] for of_pass in run["passes"]]
    assert names[:2] == ["fill_buckets", "weld_bucket"]
    assert all(of_pass["n_read"] > 0 for of_pass in run["passes"] if of_pass["jobs"] > 1)
    assert 0 < run["halo"] < 1
    done = CliRunner().invoke(commands, ["plan", str(output), "--spread", "regions"])
    assert done.exit_code == 0, done.output
    assert "| `write_tile` | 1 |" in done.output
    assert "| 1e+10 |" in done.output


def test_both_ways_are_timed_in_turns_and_their_labels_compared(tmp_path):
    write_mesh(tmp_path / "bear.ply", sample_mesh(20_000))
    words = ["compare", str(tmp_path / "bear.ply"), "-n", "30", "--repeats", "2"]
    done = CliRunner().invoke(commands, words)
    assert done.exit_code == 0, done.output
    first, second = done.output.splitlines()
    assert re.fullmatch(r"in memory \d+\.\d\d s, in tiles \d+\.\d\d s \(medians\)", first)
    assert re.fullmatch(r"ratio \d+\.\d\d, in each round \d+\.\d\d \d+\.\d\d", second)
