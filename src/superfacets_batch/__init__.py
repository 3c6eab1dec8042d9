"""Segment many files, one after the other or on Dask workers."""

from superfacets.kit import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
