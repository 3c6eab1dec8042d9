"""Fixtures of the tests of pictures."""

import sys

import pytest

from superfacets import sample_mesh
from superfacets_show.backend import RenderError, ensure_gl


@pytest.fixture(scope="session")
def gl():
    """Skip the test if there is no OpenGL."""
    pytest.importorskip("pyvista", reason="PyVista is not installed")
    try:
        ensure_gl()
    except RenderError as error:
        pytest.skip(str(error))


@pytest.fixture
def no_display(monkeypatch, request):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    monkeypatch.setattr(sys, "platform", getattr(request, "param", "linux"))


@pytest.fixture(scope="session")
def bear():
    return sample_mesh(5_000)
