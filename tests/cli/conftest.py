"""Fixtures of the tests of the command."""

from functools import partial

import numpy as np
import pytest

from superfacets import write_mesh
from superfacets_cli.main import main


@pytest.fixture
def run(run_main):
    """Return a function that runs the command here, and returns exit status, stdout and stderr."""
    return partial(run_main, main, "superfacets")


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """Write a mesh whose segmentation takes seconds with the paper's stop rule; return its path."""
    from superfacets import Mesh, sample_mesh

    bear = sample_mesh()
    places = [[3.0 * place, 0.0, 0.0] for place in range(17)]
    vertices = np.concatenate([bear.vertices + place for place in places])
    faces = np.concatenate([bear.faces + n * bear.n_vertices for n in range(len(places))])
    path = tmp_path_factory.mktemp("large") / "bear.ply"
    write_mesh(path, Mesh(vertices, faces))
    return path
