"""Divide meshes into k compact, connected regions of faces; borders follow concave creases."""

from .base.lazy import lazy_names

__version__ = "0.1.0"

# `__init__.pyi` lists the public names. Each name is imported on first use, so that a program loads
# only the modules that it needs.
__getattr__, _, __all__ = lazy_names(__name__, __file__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
