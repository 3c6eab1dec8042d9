"""Measure the sections of the benchmark, mesh by mesh, so that each mesh is built only once."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import superfacets as sf

from . import memory, passes, processes, races, runs
from .checks import Expected, check_against_reference, hash_labels, require
from .machine import facts, usable_cores
from .meshes import Arrays, build, file_of
from .plan import N_SEGMENTS, BenchmarkPlan

SECTIONS = ("stages", "scaling", "passes", "orders", "rivals", "memory", "processes")

LARGE = 1 << 17
"""Minimum number of faces of meshes that are measured in several orders of their faces."""

MEMORABLE_FACES = 50_000
"""Minimum number of faces of meshes for which memory is measured. A run on a smaller mesh may use
only memory that the allocator has kept from an earlier run."""

Results = dict[str, Any]
Say = Callable[[str], None]


def measure(plan: BenchmarkPlan, sections: frozenset[str], expected: Expected, say: Say) -> Results:
    """Return the rows of the given sections, and facts about the machine.

    Raises
    ------
    WrongLabelsError
        If labels of superfacets are wrong. No times are returned in this case.
    """
    check_against_reference()
    say("labels of a small mesh equal the labels of reference")
    results: Results = {
        "machine": facts(),
        "runs": [],
        "passes": [],
        "orders": [],
        "label_races": [],
        "pass_races": [],
        "memory": [],
    }
    if "processes" in sections:
        say("imports and the command")
        results |= _measure_processes(plan)
    for mesh in plan.meshes:
        say(f"{mesh}: {plan.meshes[mesh]:,} faces")
        _measure_mesh(plan, mesh, sections, expected, results)
    return results | {"speedups": runs.speedups(results["runs"])}


def _measure_mesh(
    plan: BenchmarkPlan, mesh: str, sections: frozenset[str], expected: Expected, results: Results
) -> None:
    """Add the rows of one mesh to `results`."""
    arrays = build(mesh, plan.data)
    repeats = plan.repeats(mesh)
    if cases := plan.cases(mesh, sections):
        results["runs"] += runs.measure(arrays, cases, repeats, expected)
    if "passes" in sections:
        results["passes"] += _measure_passes(plan, mesh, arrays)
    if "orders" in sections and plan.meshes[mesh] >= LARGE:
        results["orders"] += runs.measure_orders(mesh, arrays, N_SEGMENTS[0], repeats)
    if "memory" in sections and plan.meshes[mesh] >= MEMORABLE_FACES:
        results["memory"].append(_measure_memory(mesh, arrays))
    if "rivals" in sections:
        for n_segments in [k for raced, k in plan.races if raced == mesh]:
            results["label_races"] += races.race_for_labels(
                mesh, arrays, n_segments, repeats, expected
            )
            results["pass_races"] += races.race_for_one_pass(mesh, arrays, n_segments, repeats)


def _measure_passes(plan: BenchmarkPlan, mesh: str, arrays: Arrays) -> list[dict[str, Any]]:
    threads = dict.fromkeys([1, usable_cores()])
    keys = [(k, n) for k in N_SEGMENTS if k <= plan.meshes[mesh] for n in threads]
    return passes.measure(mesh, arrays, keys, plan.repeats(mesh))


def _measure_memory(mesh: str, arrays: Arrays) -> dict[str, Any]:
    """Measure the peak memory in a fresh process, whose labels must equal those of this process."""
    row = memory.measure(mesh, arrays, N_SEGMENTS[0])
    labels = sf.segment(arrays, N_SEGMENTS[0]).labels
    require(row.pop("labels") == hash_labels(labels), f"{mesh}: labels of another process differ")
    return row


def _measure_processes(plan: BenchmarkPlan) -> Results:
    """Time imports and the command. The command segments the bunny or, without data, the bear."""
    repeats = plan.wanted_repeats or 11
    results = {"imports": processes.measure_imports(repeats)}
    if plan.data:
        file = file_of("bunny", plan.data)
        return results | {"command": processes.measure_command("bunny", file, repeats)}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bear.ply"
        sf.write_mesh(file, sf.sample_mesh())
        return results | {"command": processes.measure_command("bear60k", file, repeats)}
