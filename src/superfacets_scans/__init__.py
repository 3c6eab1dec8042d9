"""Superpoints for networks, files of ScanNet, and labels from masks of images."""

from superfacets.kit import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
