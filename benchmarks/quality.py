"""How good regions are: variants of `superfacets.segment` on the Princeton benchmark's models.

Each variant is a set of keywords. What counts is the trade-off between two numbers, both better if
lower: the undersegmentation error (UE) and compactness. Labels do not depend on threads, nor means
on how models are shared out among processes: but for times, results are the same on each run.
"""

from __future__ import annotations

import itertools
import math
import multiprocessing
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import superfacets as sf
from superfacets import metrics
from superfacets.study.princeton import Benchmark, category_of

from .clock import median
from .machine import facts, usable_cores
from .meshes import Arrays, subdivide
from .report import table

__all__ = [
    "DEFAULT",
    "KS",
    "PLAIN",
    "SCALES",
    "VARIANTS",
    "Creases",
    "Subject",
    "coarsened",
    "creases",
    "dominators",
    "means",
    "refined",
    "render_quality",
    "study",
]

KS = (50, 100, 150, 200, 300)

PLAIN = "plain"
DEFAULT = "default"
ROUGH = "default, not smooth"
OTHER_WEIGHTS = "default, eq. 2"

_PLAIN: dict[str, Any] = {"weights": "superfacets", "init": "farthest", "smooth": False}

VARIANTS: Mapping[str, Mapping[str, Any]] = {
    PLAIN: _PLAIN,
    "plain, smooth": _PLAIN | {"smooth": True},
    "plain, geodesic": _PLAIN | {"init": "geodesic"},
    "plain, eta 0": _PLAIN | {"eta_convex": 0.0},
    "creases, farthest": {"init": "farthest"},
    "creases, farthest, alpha 40": {"init": "farthest", "alpha": 40.0},
    "creases, alpha 10": {"alpha": 10.0},
    DEFAULT: {},
    "creases, alpha 30": {"alpha": 30.0},
    "creases, alpha 40": {"alpha": 40.0},
    ROUGH: {"smooth": False},
    OTHER_WEIGHTS: {"weights": "superfacets", "eta_convex": 0.0},
    "default, eta 0.05": {"eta_convex": 0.05},
    "default, eta 0.2": {"eta_convex": 0.2},
}
"""Keywords of `superfacets.segment`, by name. `PLAIN` is the paper's method but for how it ends."""

RESOLUTION_VARIANTS = (PLAIN, OTHER_WEIGHTS, ROUGH, DEFAULT)

SHARP = math.radians(45)
"""The least angle of a crease that nobody would overlook."""

Say = Callable[[str], None]
Row = dict[str, Any]


class Subject(NamedTuple):
    """A mesh, and the true segment of each face as several people see it."""

    mesh: sf.Mesh
    truths: tuple[npt.NDArray[np.int32], ...]


class Creases(NamedTuple):
    """Sharp edges, as pairs of the faces on either side, each pair both ways around."""

    sources: npt.NDArray[np.int32]
    targets: npt.NDArray[np.int32]
    lengths: npt.NDArray[np.float64]

    def share_between(self, labels: npt.NDArray[np.int32]) -> float | None:
        """Return the share of their length that is a border between regions, if they have any."""
        total = self.lengths.sum()
        between = labels[self.sources] != labels[self.targets]
        return float(self.lengths[between].sum() / total) if total > 0 else None


class Task(NamedTuple):
    """What one process does in one go."""

    root: Path
    number: int
    scale: str
    variants: tuple[str, ...]
    ks: tuple[int, ...]


def refined(subject: Subject, levels: int = 1) -> Subject:
    """Split each face into four, so many times; the four are in the segment of the one."""
    arrays = Arrays(subject.mesh.vertices, subject.mesh.faces)
    for _ in range(levels):
        arrays = subdivide(arrays)
    truths = tuple(np.repeat(truth, 4**levels) for truth in subject.truths)
    return Subject(sf.Mesh(*arrays), truths)


def coarsened(subject: Subject) -> Subject:
    """Decimate to a quarter of the faces.

    Each is in the segment of the old face with the nearest centroid. Needs PyVista and SciPy.
    """
    import pyvista
    from scipy.spatial import KDTree

    mesh = subject.mesh
    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces.astype(int))
    decimated = surface.decimate(0.75)
    coarse = sf.Mesh(
        np.asarray(decimated.points, dtype=np.float64),
        np.asarray(decimated.regular_faces, dtype=np.int32),
    )
    _, nearest = KDTree(_centroids(mesh)).query(_centroids(coarse))
    return Subject(coarse, tuple(truth[nearest] for truth in subject.truths))


def _centroids(mesh: sf.Mesh) -> npt.NDArray[np.float64]:
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def creases(mesh: sf.Mesh) -> tuple[Creases, Creases]:
    """Return the concave and the convex edges of `SHARP` and more."""
    faces = sf.build_face_graph(mesh)
    unit = math.pi * faces.diagonal  # with it, eq. 2 adds the angle in radians

    def angles(eta_convex: float) -> npt.NDArray[np.float64]:
        priced = sf.superfacet_weights(
            mesh, faces, alpha=1.0, eta_convex=eta_convex, crease_length=unit
        )
        return priced - sf.superfacet_weights(mesh, faces, alpha=0.0)

    is_concave = angles(0.0) >= SHARP
    is_convex = (angles(1.0) >= SHARP) & ~is_concave
    sources = np.repeat(np.arange(faces.n_cells, dtype=np.int32), np.diff(faces.offsets))
    corners = mesh.faces[sources]
    arcs = np.arange(faces.n_arcs)
    starts, ends = corners[arcs, faces.sides], corners[arcs, (faces.sides + 1) % 3]
    lengths = np.linalg.norm(mesh.vertices[starts] - mesh.vertices[ends], axis=1)

    def chosen(which: npt.NDArray[np.bool_]) -> Creases:
        return Creases(sources[which], faces.neighbors[which], lengths[which])

    return chosen(is_concave), chosen(is_convex)


SCALES: Mapping[str, Callable[[Subject], Subject]] = {
    "x1/4": coarsened,
    "x1": lambda subject: subject,
    "x4": refined,
    "x16": lambda subject: refined(subject, 2),
}
"""Ways to have more or fewer faces on the same surface."""


def study(
    root: Path, numbers: Sequence[int], ks: Sequence[int], n_finer: int, say: Say
) -> dict[str, Any]:
    """Measure all variants on these models, and few of them on `n_finer` models at all scales.

    Models without ground truths are left out; they are named, as are ground truths that could not
    be used.

    Raises
    ------
    ValueError
        If a model is not there, or none has ground truths.
    """
    present = Benchmark(root).numbers
    if missing := sorted(set(numbers) - set(present)):
        raise ValueError(f"{root} has no model {missing[0]}")
    numbers, ks = sorted(set(numbers)), sorted(set(ks))
    main = [Task(root, number, "x1", tuple(VARIANTS), tuple(ks)) for number in numbers]
    some = numbers[:: max(1, len(numbers) // n_finer)][:n_finer] if n_finer else []
    middle = ks[len(ks) // 2]
    finer = [
        Task(root, number, scale, RESOLUTION_VARIANTS, (middle,))
        for scale in _usable_scales(say)
        for number in some
    ]
    results = _run(finer + main, say)
    rows = [row for found in results[len(finer) :] for row in found[0]]
    if not rows:
        raise ValueError(f"{root}: there are no ground truths")
    return {
        "machine": facts(),
        "variants": {name: dict(keywords) for name, keywords in VARIANTS.items()},
        "ks": ks,
        "models": numbers,
        "problems": [line for found in results[len(finer) :] for line in found[1]],
        "rows": rows,
        "resolution": [row for found in results[: len(finer)] for row in found[0]],
    }


def _usable_scales(say: Say) -> list[str]:
    try:
        import pyvista  # noqa: F401
        import scipy.spatial  # noqa: F401
    except ImportError:
        say("no coarser meshes: they need PyVista and SciPy")
        return [scale for scale in SCALES if scale != "x1/4"]
    return list(SCALES)


def _run(tasks: Sequence[Task], say: Say) -> list[tuple[list[Row], list[str]]]:
    """Return what `_measure` says of each task; one process per core, of one thread each."""
    results = []
    context = multiprocessing.get_context("spawn")  # a fork would copy the state of threads
    with ProcessPoolExecutor(usable_cores(), context, _use_one_thread) as pool:
        for done, result in enumerate(pool.map(_measure, tasks), 1):
            results.append(result)
            if done % 10 == 0 or done == len(tasks):
                say(f"{done} of {len(tasks)} tasks")
    return results


def _use_one_thread() -> None:
    os.environ["SUPERFACETS_NUM_THREADS"] = "1"


def _measure(task: Task) -> tuple[list[Row], list[str]]:
    """Return a row for each variant and k, and what is wrong with the ground truths."""
    model = Benchmark(task.root).load(task.number)
    problems = [line.replace(str(task.root), "").lstrip(os.sep) for line in model.problems]
    if not model.ground_truths:
        return [], problems
    subject = SCALES[task.scale](Subject(model.mesh, model.ground_truths))
    surface = metrics.GroundTruths(subject.mesh, ())  # what all labels have in common
    areas = sf.build_face_graph(subject.mesh).measures
    valleys, ridges = creases(subject.mesh)
    sf.segment(subject.mesh, task.ks[0], **VARIANTS[task.variants[0]])  # to warm up
    rows = []
    for k, name in itertools.product(task.ks, task.variants):
        start = time.process_time()  # what others do on the machine does not count
        labels = sf.segment(subject.mesh, k, **VARIANTS[name]).labels
        seconds = time.process_time() - start
        values = metrics.evaluate(subject.mesh, labels, surface)
        rows.append(
            {
                "model": task.number,
                "scale": task.scale,
                "faces": subject.mesh.n_faces,
                "variant": name,
                "k": k,
                "ue": _mean_error(labels, subject.truths, areas),
                "compactness": values["compactness"],
                "valleys": valleys.share_between(labels),
                "ridges": ridges.share_between(labels),
                "regions": int(values["n_regions"]),
                "extra_pieces": int(values["n_extra_pieces"]),
                "seconds": seconds,
            }
        )
    return rows, problems


def _mean_error(
    labels: npt.NDArray[np.int32],
    truths: Iterable[npt.NDArray[np.int32]],
    areas: npt.NDArray[np.float64],
) -> float:
    overlaps = [metrics.area_overlap(labels, truth, areas) for truth in truths]
    return float(np.mean([metrics.undersegmentation_error(overlap) for overlap in overlaps]))


Means = dict[tuple[str, int], tuple[float, float]]


def means(rows: Iterable[Row]) -> Means:
    """Return UE and compactness by variant and k: means over models."""
    values: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for row in rows:
        values.setdefault((row["variant"], row["k"]), []).append((row["ue"], row["compactness"]))
    return {key: (_mean(found, 0), _mean(found, 1)) for key, found in values.items()}


def _mean(pairs: Sequence[tuple[float, float]], part: int) -> float:
    return float(np.mean([pair[part] for pair in pairs]))


def dominators(found: Means) -> list[str]:
    """Return the variants that are at every k no worse than plain in both, and better in one."""
    ks = [k for variant, k in found if variant == PLAIN]

    def is_better(variant: str, k: int) -> bool:
        new, old = found[variant, k], found[PLAIN, k]
        return new != old and new[0] <= old[0] and new[1] <= old[1]

    variants = dict.fromkeys(variant for variant, _ in found)
    return [variant for variant in variants if all(is_better(variant, k) for k in ks)]


def render_quality(results: Mapping[str, Any]) -> str:
    """Return the tables of a study in Markdown."""
    sections = [
        ("UE / compactness by k", _frontier(results)),
        ("Against plain", _comparison(results)),
        ("UE / compactness by category", _categories(results)),
        ("UE / compactness / in valleys by number of faces", _resolution(results)),
    ]
    return "\n\n".join(f"### {title}\n\n{text}" for title, text in sections)


def _pair(values: tuple[float, float]) -> str:
    return f"{values[0]:.4f} / {values[1]:.3f}"


def _frontier(results: Mapping[str, Any]) -> str:
    found = means(results["rows"])
    return table(
        ["variant", *(f"k = {k}" for k in results["ks"])],
        ([name, *(_pair(found[name, k]) for k in results["ks"])] for name in results["variants"]),
    )


def _comparison(results: Mapping[str, Any]) -> str:
    rows = results["rows"]
    plain = {(row["model"], row["k"]): row for row in rows if row["variant"] == PLAIN}
    dominating = dominators(means(rows))
    header = [
        "variant",
        "dominates",
        "lower UE",
        "lower compactness",
        "in valleys",
        "in ridges",
        "time",
        "pieces",
        "exactly k",
    ]

    def line(name: str) -> list[str]:
        pairs = [(row, plain[row["model"], row["k"]]) for row in rows if row["variant"] == name]
        ratio = median([new["seconds"] / old["seconds"] for new, old in pairs])
        pieces = sum(new["extra_pieces"] for new, _ in pairs)
        return [
            name,
            "yes" if name in dominating else "-",
            _share(new["ue"] < old["ue"] for new, old in pairs),
            _share(new["compactness"] < old["compactness"] for new, old in pairs),
            _mean_share([new["valleys"] for new, _ in pairs]),
            _mean_share([new["ridges"] for new, _ in pairs]),
            f"{ratio:.2f}",
            str(pieces),
            _share(new["regions"] == new["k"] for new, _ in pairs),
        ]

    return table(header, map(line, results["variants"]))


def _share(cases: Iterable[bool]) -> str:
    values = list(cases)
    return f"{sum(values)} of {len(values)}"


def _mean_share(shares: Iterable[float | None]) -> str:
    """Return the mean over the models that have such creases."""
    found = [share for share in shares if share is not None]
    return f"{100 * np.mean(found):.0f} %" if found else "-"


def _resolution(results: Mapping[str, Any]) -> str:
    cells: dict[tuple[str, int], dict[str, list[Row]]] = {}
    faces: dict[str, list[int]] = {}
    for row in results["resolution"]:
        key, scale = (row["variant"], row["k"]), row["scale"]
        cells.setdefault(key, {}).setdefault(scale, []).append(row)
        faces.setdefault(scale, []).append(row["faces"])

    def cell(key: tuple[str, int], scale: str) -> str:
        rows = cells[key][scale]
        return f"{_pair(means(rows)[key])} / {_mean_share(row['valleys'] for row in rows)}"

    return table(
        ["variant", "k", *(f"{scale}: {np.mean(faces[scale]):,.0f} faces" for scale in faces)],
        ([*key, *(cell(key, scale) for scale in faces)] for key in cells),
    )


def _categories(results: Mapping[str, Any]) -> str:
    """Return plain and the default in each category, mean over k, the largest gain in UE first."""
    names = (PLAIN, DEFAULT)
    rows = [
        row | {"variant": f"{row['variant']} {category_of(row['model'])}", "k": 0}
        for row in results["rows"]
        if row["variant"] in names
    ]
    found = means(rows)

    def gain(category: str) -> float:
        return found[f"{PLAIN} {category}", 0][0] - found[f"{DEFAULT} {category}", 0][0]

    present = {category_of(row["model"]) for row in rows}
    return table(
        ["category", *names],
        (
            [category, *(_pair(found[f"{name} {category}", 0]) for name in names)]
            for category in sorted(present, key=gain, reverse=True)
        ),
    )
