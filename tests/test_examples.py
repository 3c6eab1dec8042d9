"""Programs in the documentation that need the benchmark."""

import pytest
from research import classify_regions
from research.princeton import Benchmark, category_of


def test_names_of_regions_are_learned_from_other_models(data_dir):
    """Accuracy is 34 points above guessing on five models; four must give at least 20."""
    pytest.importorskip("sklearn", reason="scikit-learn is not installed")

    benchmark = Benchmark(data_dir / "psb")
    numbers = [n for n in benchmark.numbers if category_of(n) == "Octopus"]
    if len(numbers) < 3:
        pytest.skip("there are too few models of octopuses")
    models = [benchmark.load(number) for number in numbers[:4]]
    majority, forest, n_regions = classify_regions.evaluate(models)
    assert n_regions == 150 * len(models)
    assert 0.4 < majority < 0.7
    assert forest > majority + 0.2
