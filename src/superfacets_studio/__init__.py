"""Label meshes region by region in a browser; a local web server saves the labels in work files.

Each cell (face, point or tetrahedron) can have a class, such as chair, and the number of an object
of this class, such as the second chair. Regions are used only to select cells, so a new
segmentation does not change labels.
"""

from superfacets.kit import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
