"""What tests of pictures share."""

import sys

import pytest

from superfacets.pictures.backend import RenderError, ensure_gl


@pytest.fixture(scope="session")
def gl():
    """Anything to draw with; the test is skipped where there is nothing."""
    pytest.importorskip("pyvista", reason="PyVista is not installed")
    try:
        ensure_gl()
    except RenderError as error:
        pytest.skip(str(error))


@pytest.fixture
def no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
