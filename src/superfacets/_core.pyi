"""The compiled kernels. They check nothing: arrays come from `_validate` and have exact types."""

import numpy as np
import numpy.typing as npt

_Doubles = npt.NDArray[np.float64]
_Floats = npt.NDArray[np.float32]
_Ints = npt.NDArray[np.int32]
_Longs = npt.NDArray[np.int64]
_Point = tuple[float, float, float]

def check_mesh(
    vertices: _Doubles, faces: _Ints, n_threads: int
) -> tuple[bool, bool, _Point, _Point]: ...
def narrow_indices(indices: _Longs, n_threads: int) -> _Ints: ...
def check_numbers(numbers: _Doubles, n_threads: int) -> tuple[bool, float]: ...
def weld_vertices(vertices: _Doubles, n_threads: int) -> _Ints: ...
def build_face_graph(
    faces: _Ints, representative: _Ints, n_threads: int
) -> tuple[
    _Longs, _Ints, npt.NDArray[np.uint16], npt.NDArray[np.uint8], tuple[int, int, int, int]
]: ...
def measure_faces(
    vertices: _Doubles, faces: _Ints, n_threads: int
) -> tuple[_Doubles, _Doubles]: ...
def superfacet_weights(
    vertices: _Doubles,
    faces: _Ints,
    centroids: _Doubles,
    areas: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    sides: npt.NDArray[np.uint16],
    same_turn: npt.NDArray[np.uint8],
    alpha: float,
    eta_convex: float,
    diagonal: float,
    inside_out: bool,
    n_threads: int,
) -> _Doubles: ...
def count_degenerate(vertices: _Doubles, faces: _Ints) -> int: ...
def signed_volume(vertices: _Doubles, faces: _Ints, origin: _Point, n_threads: int) -> float: ...
def quantize_weights(weights: _Doubles, n_threads: int) -> tuple[_Floats, float]: ...
def weighted_mean(positions: _Doubles, measures: _Doubles) -> _Point: ...
def nearest_cell(positions: _Doubles, target: _Point) -> int: ...
def farthest_seeds(positions: _Doubles, first: int, n_seeds: int) -> _Ints: ...
def flood_seeds(
    positions: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    lengths: _Floats,
    first: int,
    reach: float,
) -> _Ints: ...
def grid_labels(positions: _Doubles, corner: _Point, side: float) -> _Ints: ...
def classify_exact(
    positions: _Doubles, offsets: _Longs, neighbors: _Ints, lengths: _Floats, centers: _Ints
) -> tuple[_Ints, npt.NDArray[np.uint64], _Ints]: ...
def reclassify_exact(
    positions: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    lengths: _Floats,
    centers: _Ints,
    previous_labels: _Ints,
    previous_lengths: npt.NDArray[np.uint64],
    previous_centers: _Ints,
) -> tuple[_Ints, npt.NDArray[np.uint64], _Ints]: ...
def classify_halted(
    positions: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    lengths: _Floats,
    centers: _Ints,
    reach: float,
    n_threads: int,
) -> tuple[_Ints, npt.NDArray[np.uint64], _Ints]: ...
def update_centers(
    positions: _Doubles, measures: _Doubles, labels: _Ints, n_regions: int
) -> _Ints: ...
