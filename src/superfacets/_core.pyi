"""The compiled kernels. They check nothing: arrays come from `_validate` and have exact types."""

import enum

import numpy as np
import numpy.typing as npt

_Bytes = npt.NDArray[np.uint8]
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
def build_vertex_graph(
    vertices: _Doubles, faces: _Ints, representative: _Ints, n_threads: int
) -> tuple[_Longs, _Ints, _Doubles]: ...
def find_components(offsets: _Longs, neighbors: _Ints, labels: _Ints) -> tuple[_Ints, int]: ...
def measure_faces(
    vertices: _Doubles, faces: _Ints, n_threads: int
) -> tuple[_Doubles, _Doubles]: ...
def area_vectors(vertices: _Doubles, faces: _Ints, n_threads: int) -> _Doubles: ...
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
    crease_length: float,
    diagonal: float,
    inside_out: bool,
    n_threads: int,
) -> _Doubles: ...
def stk02_weights(
    vertices: _Doubles,
    faces: _Ints,
    centroids: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    sides: npt.NDArray[np.uint16],
    alpha: float,
    n_threads: int,
) -> _Doubles: ...
def count_degenerate(vertices: _Doubles, faces: _Ints) -> int: ...
def signed_volume(vertices: _Doubles, faces: _Ints, origin: _Point, n_threads: int) -> float: ...
def smooth_borders(
    vertices: _Doubles,
    faces: _Ints,
    centroids: _Doubles,
    areas: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    sides: npt.NDArray[np.uint16],
    same_turn: npt.NDArray[np.uint8],
    weights: _Doubles,
    labels: _Ints,
    fixed: _Ints,
    diagonal: float,
    max_distance: float,
    crease_scale: float,
    max_chain: int,
    max_sweeps: int,
    n_threads: int,
) -> _Ints: ...
def region_borders(
    vertices: _Doubles,
    faces: _Ints,
    centroids: _Doubles,
    areas: _Doubles,
    offsets: _Longs,
    neighbors: _Ints,
    sides: npt.NDArray[np.uint16],
    same_turn: npt.NDArray[np.uint8],
    weights: _Doubles,
    labels: _Ints,
    diagonal: float,
    crease_scale: float,
    n_threads: int,
) -> tuple[_Ints, _Ints, _Doubles]: ...
def quantize_weights(weights: _Doubles, n_threads: int) -> tuple[_Floats, float]: ...

class OrderedGraph:
    def __init__(
        self,
        positions: _Doubles,
        measures: _Doubles,
        offsets: _Longs,
        neighbors: _Ints,
        lengths: _Floats,
        n_threads: int,
    ) -> None: ...
    @property
    def n_cells(self) -> int: ...
    @property
    def total_measure(self) -> float: ...
    def positions_of(self, cells: _Ints) -> _Doubles: ...

def central_cell(graph: OrderedGraph, n_threads: int) -> int: ...
def farthest_seeds(graph: OrderedGraph, first: int, n_seeds: int, n_threads: int) -> _Ints: ...
def geodesic_seeds(graph: OrderedGraph, first: int, n_seeds: int, n_threads: int) -> _Ints: ...
def flood_seeds(graph: OrderedGraph, first: int, reach: float, n_threads: int) -> _Ints: ...
def grid_seeds(graph: OrderedGraph, corner: _Point, side: float, n_threads: int) -> _Ints: ...

class Clustering:
    def __init__(
        self, graph: OrderedGraph, centers: _Ints, reach: float, n_threads: int
    ) -> None: ...
    def classify(self, centers: _Ints) -> None: ...
    def update(self) -> _Ints: ...
    def centers(self) -> _Ints: ...
    def labels(self) -> _Ints: ...
    def lengths(self) -> npt.NDArray[np.uint64]: ...

def update_centers(graph: OrderedGraph, labels: _Ints, n_regions: int, n_threads: int) -> _Ints: ...
def path_lengths(graph: OrderedGraph, sources: _Ints, unit: float, n_threads: int) -> _Floats: ...
def path_lengths_within(
    graph: OrderedGraph, reach: float, unit: float, n_threads: int
) -> tuple[_Longs, _Ints, _Floats]: ...
def nearest_wanted(
    graph: OrderedGraph, cells: _Ints, is_wanted: npt.NDArray[np.uint8]
) -> _Ints: ...
def scan_lines(
    text: _Bytes, begin: int, end: int, comment: int, n_threads: int
) -> tuple[_Longs, _Longs, _Ints]: ...
def match_keywords(
    text: _Bytes,
    starts: _Longs,
    ends: _Longs,
    keywords: list[str],
    any_case: bool,
    n_threads: int,
) -> npt.NDArray[np.int8]: ...
def parse_doubles(
    text: _Bytes, starts: _Longs, ends: _Longs, counts: _Ints, n_threads: int
) -> tuple[_Doubles, _Longs]: ...
def parse_integers(
    text: _Bytes, starts: _Longs, ends: _Longs, counts: _Ints, n_threads: int
) -> tuple[_Ints, _Longs]: ...
def parse_long_integers(
    text: _Bytes, starts: _Longs, ends: _Longs, counts: _Ints, n_threads: int
) -> tuple[_Longs, _Longs]: ...
def parse_corners(
    text: _Bytes, starts: _Longs, ends: _Longs, counts: _Ints, n_threads: int
) -> tuple[_Ints, _Longs]: ...
def parse_long_corners(
    text: _Bytes, starts: _Longs, ends: _Longs, counts: _Ints, n_threads: int
) -> tuple[_Longs, _Longs]: ...
def copy_rows(rows: _Bytes, n_threads: int) -> _Bytes: ...

class ProxyMetric(enum.Enum):
    L2 = 0
    L21 = 1

class ProxyRegions:
    def __init__(
        self,
        vertices: _Doubles,
        faces: _Ints,
        areas: _Doubles,
        offsets: _Longs,
        neighbors: _Ints,
        metric: ProxyMetric,
        seeds: _Ints,
    ) -> None: ...
    @property
    def n_regions(self) -> int: ...
    def relax(self) -> int: ...
    def insert(self) -> None: ...
    def labels(self) -> _Ints: ...
    def seeds(self) -> _Ints: ...
