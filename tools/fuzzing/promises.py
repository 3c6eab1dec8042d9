"""Properties that must hold for any input."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapes

THREADS = (1, 2, 3, 7)

LONGEST_MESSAGE = 400  # maximum number of characters of a message, without the path


@contextlib.contextmanager
def refusals() -> Iterator[None]:
    """Suppress a ValueError or TypeError from a ``raise`` statement of this package.

    Other errors, such as errors from within numpy, are not suppressed.
    """
    try:
        yield
    except (ValueError, TypeError) as error:  # a MeshError is a ValueError
        last = traceback.extract_tb(error.__traceback__)[-1]
        if "superfacets" not in last.filename or not (last.line or "").startswith("raise "):
            raise


@contextlib.contextmanager
def short_messages(path: Path, *kinds: type[Exception]) -> Iterator[None]:
    """Suppress errors of these kinds if the message is one short line.

    If the message is not one short line, an AssertionError is raised instead.
    """
    try:
        yield
    except kinds as error:
        text = str(error).replace(str(path), "")
        if len(text) > LONGEST_MESSAGE or "\n" in text:
            raise AssertionError(f"bad message: {text!r}") from None


def check_labels(labels: Any, n_cells: int, n_regions: int) -> None:
    """Check that labels are int32, one per cell, and that each label from 0 to K - 1 occurs."""
    labels = np.asarray(labels)
    assert labels.dtype == np.int32
    assert labels.shape == (n_cells,)
    assert np.array_equal(np.unique(labels), np.arange(n_regions))


def check_result(result: Any, graph: Any) -> None:
    """Check the labels, the stop reason, and that each center is in its region."""
    check_labels(result, graph.n_cells, result.n_segments)
    assert np.array_equal(result.labels[result.centers], np.arange(result.n_segments))
    assert result.stop_reason in ("converged", "settled", "enough", "max_num_iter")


def check_number(result: Any, graph: Any, n_segments: int) -> None:
    """Check that there are `n_segments` regions, plus at most one for each further component."""
    n_components = shapes.count_pieces(graph, np.zeros(graph.n_cells, int))
    assert n_segments <= result.n_segments <= n_segments + n_components - 1


def check_pieces(labels: Any, graph: Any) -> None:
    """Check that every region is connected."""
    assert shapes.count_pieces(graph, labels) == len(np.unique(labels))
