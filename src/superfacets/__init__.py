"""SLIC for meshes: k compact, connected regions of faces whose borders follow concave creases."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .cell_graph import CellGraph
from .classify import Classification, classify
from .clustering import Segmentation, segment_graph
from .errors import MeshError, MissingExtraError
from .face_graph import EdgeCounts, FaceGraph, build_face_graph
from .mesh import Mesh
from .regions import RegionEdit, enforce_connectivity, merge_small_regions
from .seeding import place_seeds
from .segment import PAPER, segment
from .smooth import smooth_borders
from .update import update_centers
from .weights import crease_weights, stk02_weights, superfacet_weights

if TYPE_CHECKING:
    from .colors import face_colors
    from .gl import RenderError
    from .info import MeshInfo, mesh_info
    from .io import read_labels, read_mesh, write_labels, write_mesh
    from .rendering import View, render
    from .sample import sample_mesh

__version__ = "0.1.0"

__all__ = [
    "PAPER",
    "CellGraph",
    "Classification",
    "EdgeCounts",
    "FaceGraph",
    "Mesh",
    "MeshError",
    "MeshInfo",
    "MissingExtraError",
    "RegionEdit",
    "RenderError",
    "Segmentation",
    "View",
    "build_face_graph",
    "classify",
    "crease_weights",
    "enforce_connectivity",
    "face_colors",
    "merge_small_regions",
    "mesh_info",
    "place_seeds",
    "read_labels",
    "read_mesh",
    "render",
    "sample_mesh",
    "segment",
    "segment_graph",
    "smooth_borders",
    "stk02_weights",
    "superfacet_weights",
    "update_centers",
    "write_labels",
    "write_mesh",
]

# Files, colors and pictures take as long to import as the rest: they are loaded when first used.
# None of these modules has the name of something public, which importing it would hide.
_LAZY_MODULES: dict[str, tuple[str, ...]] = {
    "baselines": (),
    "colors": ("face_colors",),
    "gl": ("RenderError",),
    "info": ("MeshInfo", "mesh_info"),
    "io": ("read_labels", "read_mesh", "write_labels", "write_mesh"),
    "metrics": (),
    "princeton": (),
    "rendering": ("View", "render"),
    "sample": ("sample_mesh",),
}
_LAZY_NAMES = {name: module for module, names in _LAZY_MODULES.items() for name in names}

if not TYPE_CHECKING:  # type checkers see the imports above, and names that are not there

    def __getattr__(name: str) -> Any:
        if name in _LAZY_MODULES:
            return import_module(f".{name}", __name__)
        if name not in _LAZY_NAMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f".{_LAZY_NAMES[name]}", __name__), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *_LAZY_MODULES, *_LAZY_NAMES})
