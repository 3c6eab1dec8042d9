"""The examples in the documentation of superfacets.io."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize("name", ["read", "labels", "write"])
def test_examples_run(name):
    results = doctest.testmod(importlib.import_module(f"superfacets.io.{name}"))
    assert results.attempted > 0
    assert results.failed == 0
