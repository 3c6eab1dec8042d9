"""Formats of lidar, scanners, VTK, Gmsh, Medit, the cortex, and compressed glTF."""

from superfacets.kit import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
