"""SLIC for meshes: k compact, connected regions of faces whose borders follow concave creases."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import metrics as metrics
    from . import reference as reference
    from . import segmentator as segmentator
    from .batches.runs import BatchProgress, BatchResult, batch
    from .cells.cell_graph import ArcMeasures, CellGraph
    from .cells.face_graph import EdgeCounts, FaceGraph, build_face_graph
    from .cells.info import MeshInfo, TetInfo, mesh_info
    from .cells.nearest import NearestFaces, nearest_faces
    from .cells.parts import spectral_embedding
    from .cells.point_graph import build_point_graph, estimate_normals
    from .cells.region_adjacency import RegionGraph, region_graph
    from .cells.subdivision import Subdivision, subdivide
    from .cells.surface import arc_measures
    from .cells.tet_graph import TetGraph, TriangleCounts, build_tet_graph
    from .cells.thickness import shape_diameter
    from .cells.weights import crease_weights, stk02_weights, superfacet_weights
    from .clustering.classification import Classification, classify
    from .clustering.loop import segment_graph
    from .clustering.seeding import place_seeds
    from .clustering.segmentation import Level, Segmentation
    from .clustering.update import update_centers
    from .errors import IslandWarning, MeshError, MissingExtraError, RenderError, SliverWarning
    from .interop.attach import attach_labels
    from .io.attributes import MeshAttributes
    from .io.readers.labels import read_labels
    from .io.readers.read import read_attributes, read_cloud, read_mesh
    from .io.writers.pyg import write_graphs
    from .io.writers.regions import write_regions
    from .io.writers.write import write_labels, write_mesh
    from .levels import hierarchy
    from .mesh.point_cloud import PointCloud
    from .mesh.polygon_mesh import PolygonMesh, Triangulation
    from .mesh.tet_mesh import TetBoundary, TetMesh
    from .mesh.triangle_mesh import Mesh
    from .pictures.camera import View
    from .pictures.colors import face_colors
    from .pictures.page.document import Page, view
    from .pictures.plotting import Plot, plot
    from .pictures.rendering import render
    from .pipeline import PAPER, PARTS, segment
    from .regions.connect import enforce_connectivity
    from .regions.edit import RegionEdit
    from .regions.hierarchy import Hierarchy
    from .regions.lines import BorderLines, border_lines, find_boundaries
    from .regions.merge import merge_small_regions
    from .regions.nearest_labels import transfer
    from .regions.parts import Submesh, split_regions, submesh
    from .regions.pooling import pool, snap, unpool
    from .regions.smooth import smooth_borders
    from .regions.vertices import vertex_labels
    from .sample import sample_mesh
    from .study import baselines as baselines
    from .study import princeton as princeton
    from .tiles.segmenting import segment_tiled

__version__ = "0.1.0"

__all__ = [
    "PAPER",
    "PARTS",
    "ArcMeasures",
    "BatchProgress",
    "BatchResult",
    "BorderLines",
    "CellGraph",
    "Classification",
    "CloudInfo",
    "EdgeCounts",
    "FaceGraph",
    "Hierarchy",
    "IslandWarning",
    "Level",
    "Mesh",
    "MeshAttributes",
    "MeshError",
    "MeshInfo",
    "MissingExtraError",
    "NearestFaces",
    "Page",
    "Plot",
    "PointCloud",
    "PolygonMesh",
    "RegionEdit",
    "RegionGraph",
    "RenderError",
    "Segmentation",
    "SliverWarning",
    "Subdivision",
    "Submesh",
    "TetBoundary",
    "TetGraph",
    "TetInfo",
    "TetMesh",
    "TriangleCounts",
    "Triangulation",
    "View",
    "arc_measures",
    "attach_labels",
    "batch",
    "border_lines",
    "build_face_graph",
    "build_point_graph",
    "build_tet_graph",
    "classify",
    "cloud_info",
    "crease_weights",
    "enforce_connectivity",
    "estimate_normals",
    "face_colors",
    "find_boundaries",
    "hierarchy",
    "merge_small_regions",
    "mesh_info",
    "nearest_faces",
    "place_seeds",
    "plot",
    "pool",
    "read_attributes",
    "read_cloud",
    "read_labels",
    "read_mesh",
    "region_graph",
    "render",
    "sample_mesh",
    "segment",
    "segment_graph",
    "segment_tiled",
    "shape_diameter",
    "smooth_borders",
    "snap",
    "spectral_embedding",
    "split_regions",
    "stk02_weights",
    "subdivide",
    "submesh",
    "superfacet_weights",
    "transfer",
    "unpool",
    "update_centers",
    "vertex_labels",
    "view",
    "write_graphs",
    "write_labels",
    "write_mesh",
    "write_regions",
]

# All is loaded when it is first used: a command begins at once, and a program pays for its part.
_LAZY_NAMES = {
    "ArcMeasures": "cells.cell_graph",
    "CellGraph": "cells.cell_graph",
    "EdgeCounts": "cells.face_graph",
    "FaceGraph": "cells.face_graph",
    "build_face_graph": "cells.face_graph",
    "build_point_graph": "cells.point_graph",
    "estimate_normals": "cells.point_graph",
    "Subdivision": "cells.subdivision",
    "subdivide": "cells.subdivision",
    "arc_measures": "cells.surface",
    "TetGraph": "cells.tet_graph",
    "TriangleCounts": "cells.tet_graph",
    "build_tet_graph": "cells.tet_graph",
    "crease_weights": "cells.weights",
    "stk02_weights": "cells.weights",
    "superfacet_weights": "cells.weights",
    "Classification": "clustering.classification",
    "classify": "clustering.classification",
    "segment_graph": "clustering.loop",
    "place_seeds": "clustering.seeding",
    "Level": "clustering.segmentation",
    "Segmentation": "clustering.segmentation",
    "update_centers": "clustering.update",
    "IslandWarning": "errors",
    "MeshError": "errors",
    "MissingExtraError": "errors",
    "RenderError": "errors",
    "SliverWarning": "errors",
    "PointCloud": "mesh.point_cloud",
    "PolygonMesh": "mesh.polygon_mesh",
    "Triangulation": "mesh.polygon_mesh",
    "TetBoundary": "mesh.tet_mesh",
    "TetMesh": "mesh.tet_mesh",
    "Mesh": "mesh.triangle_mesh",
    "PAPER": "pipeline",
    "PARTS": "pipeline",
    "segment": "pipeline",
    "enforce_connectivity": "regions.connect",
    "RegionEdit": "regions.edit",
    "merge_small_regions": "regions.merge",
    "smooth_borders": "regions.smooth",
    "attach_labels": "interop.attach",
    "BatchProgress": "batches.runs",
    "BatchResult": "batches.runs",
    "batch": "batches.runs",
    "CloudInfo": "cells.info",
    "cloud_info": "cells.info",
    "Hierarchy": "regions.hierarchy",
    "hierarchy": "levels",
    "MeshInfo": "cells.info",
    "TetInfo": "cells.info",
    "mesh_info": "cells.info",
    "NearestFaces": "cells.nearest",
    "nearest_faces": "cells.nearest",
    "shape_diameter": "cells.thickness",
    "spectral_embedding": "cells.parts",
    "MeshAttributes": "io.attributes",
    "read_attributes": "io.readers.read",
    "read_cloud": "io.readers.read",
    "read_labels": "io.readers.labels",
    "read_mesh": "io.readers.read",
    "write_graphs": "io.writers.pyg",
    "write_labels": "io.writers.write",
    "write_mesh": "io.writers.write",
    "BorderLines": "regions.lines",
    "border_lines": "regions.lines",
    "find_boundaries": "regions.lines",
    "RegionGraph": "cells.region_adjacency",
    "region_graph": "cells.region_adjacency",
    "Submesh": "regions.parts",
    "split_regions": "regions.parts",
    "submesh": "regions.parts",
    "pool": "regions.pooling",
    "snap": "regions.pooling",
    "unpool": "regions.pooling",
    "transfer": "regions.nearest_labels",
    "vertex_labels": "regions.vertices",
    "write_regions": "io.writers.regions",
    "sample_mesh": "sample",
    "segment_tiled": "tiles.segmenting",
    "face_colors": "pictures.colors",
    "Page": "pictures.page.document",
    "view": "pictures.page.document",
    "Plot": "pictures.plotting",
    "plot": "pictures.plotting",
    "View": "pictures.camera",
    "render": "pictures.rendering",
}
_LAZY_MODULES = {
    "baselines": "study.baselines",
    "metrics": "metrics",
    "princeton": "study.princeton",
    "reference": "reference",
    "segmentator": "segmentator",
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
