"""Stage 4: the loop."""

from __future__ import annotations

import math

import numpy as np

from ..cells.cell_graph import CellGraph
from .classification import classify_exact, classify_halted
from .update import update_centers
from .vectors import dot


def iterate(
    graph: CellGraph,
    seeds: list[int],
    radius: float,
    *,
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    islands: str = "keep",
) -> tuple[list[tuple[list[int], list[int]]], str]:
    """Labels and centers of every iteration, and why the loop stopped."""
    history: list[tuple[list[int], list[int]]] = []
    centers = seeds
    while True:
        if radius_factor is None:
            labels, centers = classify_exact(graph, centers, islands=islands)
        else:
            reach = radius_factor * radius
            labels, centers = classify_halted(graph, centers, reach, islands=islands)
        history.append((labels, centers))
        moved_to = update_centers(graph, np.array(labels))
        moves = graph.positions[moved_to] - graph.positions[centers]
        if moved_to == centers or math.sqrt(np.mean(dot(moves, moves))) <= tol * radius:
            return history, "converged"
        if sorted(moved_to) in [sorted(earlier) for _, earlier in history]:
            return history, "cycle"
        if len(history) == max_num_iter:
            return history, "max_num_iter"
        centers = moved_to
