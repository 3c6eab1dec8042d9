"""Names that several tests of the command share."""

import sys

import pytest

COMMAND = [sys.executable, "-c", "from superfacets_cli.main import main; main()"]


def files_in(folder):
    return sorted(path.name for path in folder.iterdir())


def can_render():
    from superfacets_show.backend import RenderError, ensure_gl

    pytest.importorskip("vtkmodules")
    try:
        ensure_gl()
    except RenderError:
        return False
    return True


_SOON = "from superfacets_cli.progress import Progress as P; P.DELAY = P.STEP = 0.005; "
IMPATIENT = [*COMMAND[:2], _SOON + COMMAND[2]]
"""Same, but progress is shown from the beginning."""
