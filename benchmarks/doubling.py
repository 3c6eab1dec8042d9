"""Growth of CPU time with the number of cells, on inputs that may make algorithms quadratic.

    python -m benchmarks doubling
    python -m benchmarks doubling --shapes star,dust --smallest 64000

Each job runs on each shape in several sizes, each twice as large as the previous size. The exponent
is the slope of a line through the logarithms of times and sizes: 1 means linear growth, and 2 means
quadratic growth.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from research.table_writer import markdown_table

import superfacets as sf

LIMIT = 1.2
"""Maximum exponent that is accepted as linear. Sorting and trees take O(n log n), and arrays larger
than the cache add some tenths to the exponent."""

N_COPIES = 1000  # number of distinct positions in the cloud `copies`

Cells = sf.Mesh | sf.PolygonMesh | sf.TetMesh | sf.PointCloud
Job = Callable[[Cells], object]
Labels = npt.NDArray[np.integer[Any]]


def flat_grid(n: int) -> sf.Mesh:
    """Return a square grid of about n right triangles. Very many distances are equal."""
    side = round(math.sqrt(n / 2))
    vertices = np.moveaxis(np.mgrid[: side + 1, : side + 1, :1], 0, -1).reshape(-1, 3)
    numbers = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    return sf.Mesh(vertices, faces)


def star(n: int) -> sf.Mesh:
    """Return a cone of n triangles that share one vertex."""
    rim = 1 + np.arange(n)
    faces = np.stack([np.zeros(n, int), rim, np.roll(rim, -1)], axis=1)
    return sf.Mesh(np.concatenate([[[0, 0, 0.5]], _circle(n)]), faces)


def coin(n: int) -> sf.PolygonMesh:
    """Return a closed prism of n faces: two polygons of n - 2 corners, joined by n - 2 quads."""
    m = n - 2
    rim = np.arange(m)
    quads = np.stack([rim, np.roll(rim, -1), m + np.roll(rim, -1), m + rim], axis=1)
    indices = np.concatenate([rim[::-1], m + rim, quads.ravel()])
    offsets = np.concatenate([[0, m], 2 * m + 4 * np.arange(m + 1)])
    vertices = np.concatenate([_circle(m), _circle(m) + np.array([0, 0, 0.2])])
    return sf.PolygonMesh(vertices, offsets, indices)


def dust(n: int) -> sf.Mesh:
    """Return n separate triangles of random orientation at the nodes of a cubic lattice."""
    side = math.ceil(math.cbrt(n))
    nodes = np.moveaxis(np.mgrid[:side, :side, :side], 0, -1).reshape(-1, 1, 3)
    corners = nodes[:n] + 0.1 * np.random.default_rng(1).normal(size=(n, 3, 3))
    return sf.Mesh(corners.reshape(-1, 3), np.arange(3 * n, dtype=np.int32).reshape(-1, 3))


def one_place(n: int) -> sf.PointCloud:
    """Return n - 1 points at one position, and a point elsewhere that gives the cloud an extent."""
    positions = np.zeros((n, 3))
    positions[-1] = 1.0
    return sf.PointCloud(positions)


def line(n: int) -> sf.PointCloud:
    """Return n points on a line, equally spaced."""
    return sf.PointCloud(np.arange(n)[:, None] * [1.0, 0.5, 0.25])


def copies(n: int) -> sf.PointCloud:
    """Return n points at `N_COPIES` distinct positions, with about equally many points at each."""
    rng = np.random.default_rng(2)
    return sf.PointCloud(np.resize(rng.random((N_COPIES, 3)), (n, 3)))


def spindle(n: int) -> sf.TetMesh:
    """Return n tetrahedra around a common edge."""
    rim = 2 + np.arange(n)
    axis = np.broadcast_to([0, 1], (n, 2))
    tets = np.concatenate([axis, np.stack([rim, np.roll(rim, -1)], axis=1)], axis=1)
    return sf.TetMesh(np.concatenate([[[0, 0, -1], [0, 0, 1]], _circle(n)]), tets)


def book(n: int) -> sf.Mesh:
    """Return n triangles around a common edge."""
    tets = spindle(n)
    return sf.Mesh(tets.vertices, tets.tets[:, :3])


def twins(n: int) -> sf.PolygonMesh:
    """Return two polygons that have all of their n sides in common."""
    rim = np.arange(n)
    corners = np.concatenate([rim, rim[::-1]])
    return sf.PolygonMesh(_circle(n), np.array([0, n, 2 * n]), corners)


def _circle(n: int) -> npt.NDArray[np.float64]:
    angles = np.arange(n) * (2 * np.pi / n)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)


SHAPES: dict[str, Callable[[int], Cells]] = {
    "flat grid": flat_grid, "star": star, "coin": coin, "dust": dust, "one place": one_place,
    "line": line, "copies": copies, "spindle": spindle, "book": book, "twins": twins,
}  # fmt: skip


def segment(
    cells: Cells, *, share: float | None = None, method: Callable[..., object] = sf.segment,
    **options: Any,
) -> object:  # fmt: skip
    """Segment N cells into `share` * N regions, on one thread; by default, into 150 regions."""
    n_segments = None if share is None else max(1, int(share * cells.n_cells))
    return method(cells, n_segments, n_threads=1, **options)


of_paper = partial(segment, method=sf.paper.segment)
"""Segment cells by the algorithm of the paper."""


def graph_of_regions(cells: Cells) -> object:
    """Build the region graph of regions of two cells each."""
    return sf.region_graph(cells, np.arange(cells.n_cells) // 2, n_threads=1)


def smooth_borders_of_regions(cells: Cells) -> object:
    """Cut faces along smooth borders between regions of 32 faces each."""
    assert isinstance(cells, sf.Mesh | sf.PolygonMesh)
    return sf.cut_borders(cells, np.arange(cells.n_cells) // 32, n_threads=1)


def labels_along_creases(cells: Cells) -> object:
    """Compute labels of vertices from regions of two cells each."""
    labels = np.arange(cells.n_cells) // 2
    return sf.vertex_labels(cells, labels, method="creases", min_vertices=8, n_threads=1)


def smooth_borders_of_third(cells: Cells) -> object:
    """Smooth the borders of a region of two thirds of the cells; all others are regions."""
    assert isinstance(cells, sf.Mesh | sf.PolygonMesh)
    numbers = np.arange(cells.n_cells)
    return sf.smooth_borders(cells, np.where(numbers % 3, 0, numbers // 3 + 1), n_threads=1)


def merge_levels(cells: Cells, labels: Labels) -> object:
    """Merge regions to half of their number, and to one."""
    counts = sorted({1, (int(labels.max()) + 2) // 2})
    return sf.hierarchy(cells, counts, labels=labels, islands="nearest", n_threads=1)


OF_REGIONS: dict[str, Callable[[Any, Labels], object]] = {
    "region_graph": partial(sf.region_graph, n_threads=1),
    "merge_small_regions": partial(sf.merge_small_regions, min_size=20.0, n_threads=1),
    "enforce_connectivity": partial(sf.enforce_connectivity, n_threads=1),
    "smooth_borders": partial(sf.smooth_borders, n_threads=1),
    "cut_borders": partial(sf.cut_borders, n_threads=1),
    "border_lines": partial(sf.border_lines, n_threads=1),
    "find_boundaries": partial(sf.find_boundaries, n_threads=1),
    "hierarchy": merge_levels,
    "pool": lambda _, labels: sf.pool(labels, labels.astype(float)),
    "split_regions": lambda cells, labels: list(sf.split_regions(cells, labels)),
    "face_colors": sf.face_colors,
    "vertex_labels": partial(sf.vertex_labels, method="creases", min_vertices=20, n_threads=1),
}
"""Functions of a mesh and labels. Each is a job with a region for each face, and a job with one
region of all faces."""


def _job_of_regions(name: str, divisor: float) -> Job:
    return lambda cells: OF_REGIONS[name](cells, (np.arange(cells.n_cells) // divisor).astype(int))


JOBS: dict[str, Job] = {
    "defaults": segment,
    "k = N": partial(segment, share=1.0),
    "k = N/2": partial(segment, share=0.5),
    "islands": partial(segment, islands="nearest"),
    "islands, k = N/2": partial(segment, share=0.5, islands="nearest"),
    "farthest": partial(segment, share=0.5, init="farthest"),
    "flood": partial(of_paper, share=0.5, init="flood", radius_factor=None),
    "grid": partial(of_paper, share=0.5, init="grid", radius_factor=None),
    "halted": partial(of_paper, share=0.5),
    "halted, 150": of_paper,
    "region_graph": graph_of_regions,
    "cut_borders": smooth_borders_of_regions,
    "vertex_labels": labels_along_creases,
    "smooth_borders": smooth_borders_of_third,
    **{f"{name}, one face each": _job_of_regions(name, 1) for name in OF_REGIONS},
    **{f"{name}, one region": _job_of_regions(name, math.inf) for name in OF_REGIONS},
}


SHAPES_OF: dict[str, tuple[str, ...]] = {
    **{
        job: tuple(shape for shape in SHAPES if shape != "spindle")
        for job in ("flood", "grid", "halted", "halted, 150")
    },
    "cut_borders": ("flat grid", "star", "coin", "dust"),
    "vertex_labels": ("flat grid", "star", "coin", "dust", "spindle"),
    "smooth_borders": ("flat grid", "star", "coin", "dust"),
    **{job: ("flat grid", "star", "coin", "dust") for job in JOBS if ", one " in job},
}
"""Names of the shapes on which a job runs, for jobs that need faces, angles or vertices. All other
jobs run on all shapes."""


@dataclass(frozen=True)
class Growth:
    """CPU times of one job on one shape."""

    shape: str
    job: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]

    @property
    def exponent(self) -> float:
        """Result of the function `exponent` for these sizes and times."""
        return exponent(self.sizes, self.seconds)


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Return the exponent p in seconds = c * size^p, by a least squares fit of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def measure_doubling(
    shapes: Sequence[str], jobs: Sequence[str], sizes: Sequence[int], repeats: int
) -> Iterator[Growth]:
    """Run each job on each shape in all sizes, except where `SHAPES_OF` leaves a shape out.

    Yields the shortest of `repeats` CPU times for each size.
    """
    for shape in shapes:
        inputs = [SHAPES[shape](size) for size in sizes]
        for job in jobs:
            if shape not in SHAPES_OF.get(job, shapes):
                continue
            seconds = [_cpu_time(partial(JOBS[job], cells), repeats) for cells in inputs]
            yield Growth(shape, job, tuple(sizes), tuple(seconds))


def _cpu_time(job: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        with warnings.catch_warnings():  # warnings about slivers and islands
            warnings.simplefilter("ignore")
            start = time.process_time()
            job()
            times.append(time.process_time() - start)
    return min(times)


def doubling_table(results: Sequence[Growth]) -> str:
    """Return the exponents as a table in Markdown: a row for each job, a column for each shape."""
    shapes = list(dict.fromkeys(growth.shape for growth in results))
    found = {(growth.job, growth.shape): growth for growth in results}
    rows = []
    for job in dict.fromkeys(growth.job for growth in results):
        cells = [found.get((job, shape)) for shape in shapes]
        rows.append([job, *("" if cell is None else f"{cell.exponent:.2f}" for cell in cells)])
    return markdown_table(["job", *shapes], rows)
