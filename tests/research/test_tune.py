"""The search for constants."""

import numpy as np
from research import tune

from superfacets.stages import borders


def test_the_strategy_finds_the_minimum_of_a_narrow_valley():
    strategy, goal = tune.Strategy(5), np.arange(5.0)
    for _ in range(60):
        candidates = strategy.asked()
        squares = (candidates - goal) ** 2
        strategy.told(candidates, (squares @ [1, 10, 100, 1, 1]).tolist())
    assert abs(strategy.mean - goal).max() < 0.1


def test_no_shift_keeps_the_constants():
    tune.use(np.zeros(len(tune.SCALES)))
    assert tuple(tune.values_of(np.zeros(len(tune.SCALES))).values()) == tune.PRESENT
    assert tune.PRESENT[0] == borders.BORDER_FACTOR
