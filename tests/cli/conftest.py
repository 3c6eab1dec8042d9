"""Fixtures of the tests of the command."""

import sys

import numpy as np
import pytest
import shapes

from superfacets import write_mesh
from superfacets.cli.main import main


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command in this process; returns exit status, stdout and stderr."""

    def _run(*arguments):
        monkeypatch.setattr(sys, "argv", ["superfacets", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code, *capsys.readouterr()

    return _run


@pytest.fixture
def sheet(tmp_path):
    """A file with a mesh of 1,152 faces."""
    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(24))
    return path


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """A file that takes seconds to segment with the paper's stop rule."""
    from superfacets import Mesh, sample_mesh

    bear = sample_mesh()
    places = [[3.0 * place, 0.0, 0.0] for place in range(17)]
    vertices = np.concatenate([bear.vertices + place for place in places])
    faces = np.concatenate([bear.faces + n * bear.n_vertices for n in range(len(places))])
    path = tmp_path_factory.mktemp("large") / "bear.ply"
    write_mesh(path, Mesh(vertices, faces))
    return path
