"""The modules that drawing needs, all of which come with PyVista.

PyVista itself is not among them: its import takes longer than the segmentation of a large scan.
"""

from __future__ import annotations

import importlib
from types import SimpleNamespace
from typing import Any

from ..errors import MissingExtraError, RenderError

# The last but one holds the classes that draw, which VTK looks up when a window is made.
_VTK_MODULES = (
    "vtkCommonCore",
    "vtkCommonDataModel",
    "vtkFiltersCore",
    "vtkRenderingCore",
    "vtkRenderingOpenGL2",
    "util.numpy_support",
)


def import_vtk() -> Any:
    """Return the parts of VTK that are used, as one namespace, without loading OpenGL.

    Raises
    ------
    MissingExtraError
        If VTK is not installed.
    RenderError
        If it is, but cannot be loaded.
    """
    members: dict[str, Any] = {}
    try:
        for name in _VTK_MODULES:
            members |= vars(importlib.import_module(f"vtkmodules.{name}"))
    except ModuleNotFoundError:
        raise MissingExtraError("rendering", "viz") from None
    except ImportError as error:
        raise RenderError(f"VTK cannot be loaded: {error}") from error
    return SimpleNamespace(**members)


def import_pillow(module: str) -> Any:
    """Return a module of Pillow; a MissingExtraError if it is not installed."""
    try:
        return importlib.import_module(f"PIL.{module}")
    except ModuleNotFoundError:
        raise MissingExtraError("rendering", "viz") from None
