"""SLIC for meshes: k compact, connected regions of faces whose borders follow concave creases."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .cells.cell_graph import ArcMeasures, CellGraph
from .cells.face_graph import EdgeCounts, FaceGraph, build_face_graph
from .cells.point_graph import build_point_graph, estimate_normals
from .cells.subdivision import Subdivision, subdivide
from .cells.surface import arc_measures
from .cells.tet_graph import TetGraph, TriangleCounts, build_tet_graph
from .cells.weights import crease_weights, stk02_weights, superfacet_weights
from .clustering.classification import Classification, classify
from .clustering.loop import segment_graph
from .clustering.seeding import place_seeds
from .clustering.segmentation import Level, Segmentation
from .clustering.update import update_centers
from .errors import IslandWarning, MeshError, MissingExtraError, RenderError, SliverWarning
from .mesh.point_cloud import PointCloud
from .mesh.polygon_mesh import PolygonMesh, Triangulation
from .mesh.tet_mesh import TetBoundary, TetMesh
from .mesh.triangle_mesh import Mesh
from .pipeline import PAPER, segment
from .regions.connect import enforce_connectivity
from .regions.edit import RegionEdit
from .regions.merge import merge_small_regions
from .regions.smooth import smooth_borders

if TYPE_CHECKING:
    from . import metrics as metrics
    from . import reference as reference
    from .batches.runs import BatchProgress, BatchResult, batch
    from .cells.cloud_info import CloudInfo, cloud_info
    from .cells.info import MeshInfo, TetInfo, mesh_info
    from .io.attributes import MeshAttributes
    from .io.readers.labels import read_labels
    from .io.readers.read import read_attributes, read_cloud, read_mesh
    from .io.writers.write import write_labels, write_mesh
    from .sample import sample_mesh
    from .study import baselines as baselines
    from .study import princeton as princeton
    from .view.camera import View
    from .view.colors import face_colors
    from .view.rendering import render

__version__ = "0.1.0"

__all__ = [
    "PAPER",
    "ArcMeasures",
    "BatchProgress",
    "BatchResult",
    "CellGraph",
    "Classification",
    "CloudInfo",
    "EdgeCounts",
    "FaceGraph",
    "IslandWarning",
    "Level",
    "Mesh",
    "MeshAttributes",
    "MeshError",
    "MeshInfo",
    "MissingExtraError",
    "PointCloud",
    "PolygonMesh",
    "RegionEdit",
    "RenderError",
    "Segmentation",
    "SliverWarning",
    "Subdivision",
    "TetBoundary",
    "TetGraph",
    "TetInfo",
    "TetMesh",
    "TriangleCounts",
    "Triangulation",
    "View",
    "arc_measures",
    "batch",
    "build_face_graph",
    "build_point_graph",
    "build_tet_graph",
    "classify",
    "cloud_info",
    "crease_weights",
    "enforce_connectivity",
    "estimate_normals",
    "face_colors",
    "merge_small_regions",
    "mesh_info",
    "place_seeds",
    "read_attributes",
    "read_cloud",
    "read_labels",
    "read_mesh",
    "render",
    "sample_mesh",
    "segment",
    "segment_graph",
    "smooth_borders",
    "stk02_weights",
    "subdivide",
    "superfacet_weights",
    "update_centers",
    "write_labels",
    "write_mesh",
]

# Files, colors and pictures take as long to import as the rest: they are loaded when first used.
_LAZY_NAMES = {
    "BatchProgress": "batches.runs",
    "BatchResult": "batches.runs",
    "batch": "batches.runs",
    "CloudInfo": "cells.cloud_info",
    "cloud_info": "cells.cloud_info",
    "MeshInfo": "cells.info",
    "TetInfo": "cells.info",
    "mesh_info": "cells.info",
    "MeshAttributes": "io.attributes",
    "read_attributes": "io.readers.read",
    "read_cloud": "io.readers.read",
    "read_labels": "io.readers.labels",
    "read_mesh": "io.readers.read",
    "write_labels": "io.writers.write",
    "write_mesh": "io.writers.write",
    "sample_mesh": "sample",
    "face_colors": "view.colors",
    "View": "view.camera",
    "render": "view.rendering",
}
_LAZY_MODULES = {
    "baselines": "study.baselines",
    "metrics": "metrics",
    "princeton": "study.princeton",
    "reference": "reference",
}

if not TYPE_CHECKING:  # type checkers see the imports above, and names that are not there

    def __getattr__(name: str) -> Any:
        if name in _LAZY_MODULES:
            value = import_module(f".{_LAZY_MODULES[name]}", __name__)
        elif name in _LAZY_NAMES:
            value = getattr(import_module(f".{_LAZY_NAMES[name]}", __name__), name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*__all__, *_LAZY_MODULES, "__version__"})
