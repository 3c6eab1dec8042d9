"""Type aliases for arrays, named after the type of their elements."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[Any]
"""Array of any type of elements."""
Bools: TypeAlias = npt.NDArray[np.bool_]
"""Array of bool, which is used for masks."""
Bytes: TypeAlias = npt.NDArray[np.uint8]
"""Array of uint8, which is used for colors and for the content of files."""
Floats: TypeAlias = npt.NDArray[np.float64]
"""Array of float64, which is used for positions, measures and weights."""
Singles: TypeAlias = npt.NDArray[np.float32]
"""Array of float32."""
Ints: TypeAlias = npt.NDArray[np.int32]
"""Array of int32, which is used for labels and for indices of cells and vertices."""
Longs: TypeAlias = npt.NDArray[np.int64]
"""Array of int64, which is used for offsets into concatenated lists."""

ArcLists: TypeAlias = tuple[Longs, Ints]
"""Arcs of N cells in CSR form: offsets of shape (N + 1,) and neighbors of shape (M,)."""

Viewpoint: TypeAlias = tuple[float, float, float]
"""Position (x, y, z) of the sensor that recorded a point cloud."""
