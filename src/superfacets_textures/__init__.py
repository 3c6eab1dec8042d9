"""Materials, images, colors of faces, and images of labels."""

from superfacets.kit import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
