"""Divide meshes into k compact, connected regions of faces; borders follow concave creases."""

from pathlib import Path
from typing import Any

from .base.lazy import homes_in, import_from

__version__ = "0.1.0"

# `__init__.pyi` lists the public names. Each name is imported on first use, so that a program loads
# only the modules that it needs.
_HOMES = homes_in(Path(__file__).with_suffix(".pyi"))
__all__ = list(_HOMES)


def __getattr__(name: str) -> Any:
    """Import the public object or module `name` on first use, and store it in this module."""
    value = globals()[name] = import_from(_HOMES, name, __name__, __name__)
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
