"""SLIC for meshes: k compact, connected regions of faces whose borders follow concave creases."""

from .cell_graph import CellGraph
from .classify import Classification, classify
from .colors import face_colors
from .errors import MeshError, MissingExtraError
from .face_graph import EdgeCounts, FaceGraph, build_face_graph
from .gl import RenderError
from .info import MeshInfo, mesh_info
from .io import read_labels, read_mesh, write_labels, write_mesh
from .mesh import Mesh
from .render import View, render
from .sample import sample_mesh
from .seeding import place_seeds
from .segment import PAPER, Segmentation, segment, segment_graph
from .update import update_centers
from .weights import superfacet_weights

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
    "RenderError",
    "Segmentation",
    "View",
    "build_face_graph",
    "classify",
    "face_colors",
    "mesh_info",
    "place_seeds",
    "read_labels",
    "read_mesh",
    "render",
    "sample_mesh",
    "segment",
    "segment_graph",
    "superfacet_weights",
    "update_centers",
    "write_labels",
    "write_mesh",
]
