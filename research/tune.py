"""Tune the constants of the default weights on the benchmark, by an evolution strategy (CMA-ES).

    python -m research.tune psb MINUTES

`psb` is a folder with off/N.off and seg/Benchmark/N/N_j.seg. The constants are scaled by factors,
and the coefficients of the rate of borders, which `research.border_rates` fits, are shifted. Every
second model is used. All models are turned at random, by other rotations in each generation,
because the quality of one rotation varies by chance. Every fifth generation is compared with the
present constants on the models that are not used. A generation takes about a minute on two cores.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from multiprocessing import Pool
from typing import Any

import numpy as np

from superfacets import Mesh, metrics, segment
from superfacets.base.types import Floats
from superfacets.cleanup import smooth
from superfacets.stages import borders, cluster, part_costs
from superfacets.weights import formulas, parts

from .princeton import Benchmark

NAMES = ("BORDER_FACTOR", "alpha", "gamma", "stiffness", "max_distance", "PART_CREASE_SCALE",
         "CREASE_STEEPNESS")  # fmt: skip

COEFFICIENTS = parts.BORDER_COEFFICIENTS
SCALES = np.concatenate([0.25 * np.abs(COEFFICIENTS) + 0.15, np.full(len(NAMES), 0.25)])
"""Initial step size of each coefficient, and then of the logarithm of each factor."""

DEFAULTS = formulas.WEIGHTS["parts"].defaults
PRESENT = (borders.BORDER_FACTOR, DEFAULTS["alpha"], DEFAULTS["gamma"], smooth.OF_PARTS.stiffness,
           smooth.OF_PARTS.max_distance, part_costs.PART_CREASE_SCALE,
           parts.CREASE_STEEPNESS)  # fmt: skip
"""Present values of the constants `NAMES`."""

KS = (50, 150, 300)
LEAST_ERRORS = np.array([0.172, 0.1035, 0.074])
"""Target undersegmentation error for each number of regions."""

PRICES = np.array([0.45, 0.28, 0.17])
"""Factors of compactness in `loss`. They were chosen so that the loss does not change if only
``BORDER_FACTOR`` changes, which lowers the error and raises the compactness, or the reverse."""

N_TRIED = 12
"""Number of candidates in a generation."""


def values_of(shift: Floats) -> dict[str, float]:
    """Return the constants `NAMES` for a shift, (17,), in units of `SCALES`."""
    factors = np.exp((shift * SCALES)[len(COEFFICIENTS) :])
    return dict(zip(NAMES, (np.array(PRESENT) * factors).tolist(), strict=True))


def use(shift: Floats) -> None:
    """Set all constants in this process."""
    found = values_of(shift)
    named = {name: found[name] for name in ("alpha", "gamma")}
    weights: Any = formulas.WEIGHTS
    weights["parts"] = replace(weights["parts"], defaults={**DEFAULTS, **named})
    smoothing = smooth.OF_PARTS._replace(
        stiffness=found["stiffness"], max_distance=found["max_distance"]
    )
    coefficients = COEFFICIENTS + (shift * SCALES)[: len(COEFFICIENTS)]
    for module, name, value in (
        (borders, "BORDER_COEFFICIENTS", coefficients),
        (borders, "BORDER_FACTOR", found["BORDER_FACTOR"]),
        (cluster, "OF_PARTS", smoothing),
        (cluster, "PART_CREASE_SCALE", found["PART_CREASE_SCALE"]),
        (parts, "CREASE_STEEPNESS", found["CREASE_STEEPNESS"]),
    ):
        setattr(module, name, value)


def quality(task: tuple[str, Sequence[int], Floats, int]) -> Floats:
    """Return the mean undersegmentation error and compactness for each of `KS`, (2, 3)."""
    folder, numbers, shift, seed = task
    use(shift)
    found = []
    for number in numbers:
        model = Benchmark(folder).load(number)
        rotation, _ = np.linalg.qr(np.random.default_rng([seed, number]).normal(size=(3, 3)))
        rotation *= np.linalg.det(rotation)  # 1 or -1
        mesh = Mesh(model.mesh.vertices @ rotation.T, model.mesh.faces)
        rows = [
            metrics.evaluate(mesh, segment(mesh, k, n_threads=1), model.ground_truths) for k in KS
        ]
        names = ("undersegmentation_error", "compactness")
        found.append([[row[name] for row in rows] for name in names])
    return np.asarray(np.mean(found, axis=0))


def loss(found: Floats) -> float:
    """Return the errors relative to their targets, plus the compactness times `PRICES`."""
    errors, compactness = found
    return float((errors / LEAST_ERRORS).sum() + (PRICES * compactness).sum())


class Strategy:
    """CMA-ES, after Hansen 2016, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772."""

    def __init__(self, n: int) -> None:
        half = N_TRIED // 2
        weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
        self.weights = weights / weights.sum()
        self.mass = 1 / (self.weights**2).sum()
        self.mean, self.covariance, self.step = np.zeros(n), np.eye(n), 0.5
        self.paths = np.zeros((2, n))  # of the step size, and of the covariance
        self.rng = np.random.default_rng(0)

    def asked(self) -> Floats:
        """Return candidates, (N_TRIED, n)."""
        drawn = self.rng.normal(size=(N_TRIED, len(self.mean)))
        return self.mean + self.step * drawn @ np.linalg.cholesky(self.covariance).T

    def told(self, candidates: Floats, losses: Sequence[float]) -> None:
        """Move toward the better half of the candidates."""
        n, mass = len(self.mean), self.mass
        best = np.argsort(losses)[: len(self.weights)]
        steps = (candidates[best] - self.mean) / self.step
        move = self.weights @ steps
        self.mean = self.mean + self.step * move
        rate = (mass + 2) / (n + mass + 5)
        white = np.linalg.solve(np.linalg.cholesky(self.covariance), move)
        usual = np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))
        self.paths[0] = (1 - rate) * self.paths[0] + np.sqrt(rate * (2 - rate) * mass) * white
        self.step *= np.exp(rate / (1 + rate) * (np.linalg.norm(self.paths[0]) / usual - 1))
        slow = (4 + mass / n) / (n + 4 + 2 * mass / n)
        self.paths[1] = (1 - slow) * self.paths[1] + np.sqrt(slow * (2 - slow) * mass) * move
        one = 2 / ((n + 1.3) ** 2 + mass)
        many = min(1 - one, 2 * (mass - 2 + 1 / mass) / ((n + 2) ** 2 + mass))
        found = one * np.outer(self.paths[1], self.paths[1])
        found += many * (steps.T * self.weights) @ steps
        self.covariance = (1 - one - many) * self.covariance + found


def main(folder: str, minutes: str) -> None:
    """Search, and print the mean of each fifth generation and its quality on other models."""
    numbers = Benchmark(folder).numbers
    strategy, end = Strategy(len(SCALES)), time.monotonic() + 60 * float(minutes)
    seed = 0
    with Pool() as pool:
        while time.monotonic() < end:
            seed += 1
            candidates = strategy.asked()
            tasks = [(folder, numbers[::2], shift, seed) for shift in candidates]
            strategy.told(candidates, [loss(row) for row in pool.map(quality, tasks, 1)])
            if seed % 5:
                continue
            shifts = (np.zeros(len(SCALES)), strategy.mean)
            tasks = [(folder, numbers[1::2], shift, seed) for shift in shifts]
            for name, found in zip(("present", "new"), pool.map(quality, tasks, 1), strict=True):
                print(seed, name, found.round(4).tolist(), round(loss(found), 4), flush=True)
            shifted = COEFFICIENTS + (strategy.mean * SCALES)[: len(COEFFICIENTS)]
            print(shifted.round(3).tolist(), values_of(strategy.mean), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
