"""Areas and volumes of cells, where nothing else is asked of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..mesh.faces import AnyCells, measure_faces
from ..mesh.point_cloud import PointCloud
from ..mesh.tet_mesh import TetMesh, signed_volumes
from .cell_graph import CellGraph
from .point_graph import find_point_graph

__all__ = ["measures_of"]


def measures_of(cells: AnyCells | CellGraph, n_threads: int) -> npt.NDArray[np.float64]:
    """Area of each face, volume of each tetrahedron, area around each point, shape (N,).

    Those of a graph are its own. Only a point cloud needs its neighbors for that.
    """
    if isinstance(cells, CellGraph):
        return cells.measures
    if isinstance(cells, PointCloud):
        return find_point_graph(cells, n_threads).measures
    if isinstance(cells, TetMesh):
        return np.abs(signed_volumes(cells))
    return measure_faces(cells, n_threads)[1]
