"""Divide meshes into k compact, connected regions of faces; borders follow concave creases."""

import importlib
import re
from pathlib import Path
from typing import Any

__version__ = "0.1.0"

# `__init__.pyi` lists the public names. Each name is imported on first use, so that a program loads
# only the modules that it needs.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULES = {
    name: home for home, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)
}
__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    """Import the public object or module `name` on first use, and store it in this module."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = importlib.import_module(_MODULES[name], __name__)
    if home.__name__ != __name__ and hasattr(home, name):
        value = getattr(home, name)
    else:
        value = importlib.import_module(f"{home.__name__}.{name}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
