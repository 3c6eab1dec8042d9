"""The readable twin of `variational_shape_approximation`."""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from ..mesh.triangle_mesh import Mesh
from .cells import build_face_graph, measure_faces
from .weights import unit_normals

Vector = list[float]
Matrix = list[list[float]]


class Proxy(NamedTuple):
    """A plane, or a point if the normal is zero."""

    center: Vector
    normal: Vector


class State(NamedTuple):
    """Labels of all faces, and the seeds and proxies of the regions."""

    labels: list[int]
    seeds: list[int]
    proxies: list[Proxy]


class Surface:
    """Faces by their corners, areas, centroids, normals and neighbors."""

    def __init__(self, mesh: Mesh, metric: str, *, weld: bool = True) -> None:
        self.metric = metric
        self.corners: list[list[Vector]] = mesh.vertices[mesh.faces].tolist()
        centroids, areas = measure_faces(mesh)
        self.centroids: list[Vector] = centroids.tolist()
        self.areas: list[float] = areas.tolist()
        self.normals: list[Vector] = unit_normals(mesh).tolist()
        self.neighbors: list[list[int]] = [[] for _ in self.areas]
        for arc in build_face_graph(mesh, weld=weld):
            self.neighbors[arc.face].append(arc.neighbor)

    def own_proxy(self, face: int) -> Proxy:
        """The plane of a face."""
        return Proxy(self.centroids[face], self.normals[face])


def approximate(
    surface: Surface, k: int, seeds: list[int] | None, max_num_iter: int
) -> tuple[State, int, str]:
    """The last state, the number of iterations, and the stop reason; by default seeds are added."""
    if seeds is None:
        state = flood(surface, [0], [surface.own_proxy(0)])
        while len(state.seeds) < k:
            state = _insert(surface, state)
    else:
        state = flood(surface, seeds, [surface.own_proxy(seed) for seed in seeds])
    seen = [state.labels]
    while len(seen) < max_num_iter:
        proxies = fit(surface, state.labels)
        state = flood(surface, _least_faces(surface, state.labels, proxies), proxies)
        if state.labels in seen:
            stop_reason = "converged" if state.labels == seen[-1] else "settled"
            return state, len(seen) + 1, stop_reason
        seen.append(state.labels)
    return state, len(seen), "max_num_iter"


def flood(surface: Surface, seeds: list[int], proxies: list[Proxy]) -> State:
    """Grow regions face by face, in the order of error, then of insertion."""
    seeds, proxies = list(seeds), list(proxies)
    labels = [-1] * len(surface.areas)
    queue: list[tuple[float, int, int, int]] = []  # error, number of insertion, face, label
    n_queued = 0
    started: list[int] = []  # faces whose neighbors will be queued
    for label, seed in enumerate(seeds):
        labels[seed] = label
        started.append(seed)
    while True:
        for face in started:
            for neighbor in surface.neighbors[face]:
                error = error_of(surface, neighbor, proxies[labels[face]])
                heapq.heappush(queue, (error, n_queued, neighbor, labels[face]))
                n_queued += 1
        started = []
        if queue:
            _, _, face, label = heapq.heappop(queue)
            if labels[face] == -1:
                labels[face] = label
                started = [face]
        elif -1 in labels:  # a component without a seed
            orphan = labels.index(-1)
            labels[orphan] = len(seeds)
            started = [orphan]
            seeds.append(orphan)
            proxies.append(surface.own_proxy(orphan))
        else:
            return State(labels, seeds, proxies)


def _insert(surface: Surface, state: State) -> State:
    """Add a region at the worst face of the worst region that has at least two faces."""
    proxies = fit(surface, state.labels)
    seeds = _least_faces(surface, state.labels, proxies)
    errors = _errors(surface, state.labels, proxies)
    totals = [0.0] * len(seeds)
    for label, error in zip(state.labels, errors, strict=True):
        totals[label] += error
    sizes = np.bincount(state.labels)
    worst = max((r for r in range(len(seeds)) if sizes[r] >= 2), key=lambda r: totals[r])
    members = [face for face, label in enumerate(state.labels) if label == worst]
    members.remove(seeds[worst])
    seed = max(members, key=lambda face: (errors[face], face))
    return flood(surface, [*seeds, seed], [*proxies, surface.own_proxy(seed)])


def _errors(surface: Surface, labels: list[int], proxies: list[Proxy]) -> list[float]:
    return [error_of(surface, face, proxies[label]) for face, label in enumerate(labels)]


def _least_faces(surface: Surface, labels: list[int], proxies: list[Proxy]) -> list[int]:
    """The face of least error of each region; faces without a normal come last."""
    errors = _errors(surface, labels, proxies)
    ranks = [
        (not any(normal), error) for normal, error in zip(surface.normals, errors, strict=True)
    ]
    best: dict[int, int] = {}
    for face, label in enumerate(labels):
        if label not in best or ranks[face] < ranks[best[label]]:
            best[label] = face
    return [best[label] for label in range(len(proxies))]


def error_of(surface: Surface, face: int, proxy: Proxy) -> float:
    """Error of a face with respect to a proxy."""
    area, normal = surface.areas[face], surface.normals[face]
    if surface.metric == "l21":
        if not any(normal):
            return 0.0
        if not any(proxy.normal):
            return 2.0 * area
        difference = _minus(normal, proxy.normal)
        return area * _dot(difference, difference)
    steps = [_minus(corner, proxy.center) for corner in surface.corners[face]]
    if any(proxy.normal):
        return area / 6.0 * _integral(*(_dot(proxy.normal, step) for step in steps))
    x, y, z = (_integral(*(step[axis] for step in steps)) for axis in range(3))
    return area / 6.0 * (x + y + z)


def fit(surface: Surface, labels: list[int]) -> list[Proxy]:
    """The proxy of least error for each region."""
    return [
        _fit_one(surface, [face for face, label in enumerate(labels) if label == region])
        for region in range(max(labels) + 1)
    ]


def _fit_one(surface: Surface, faces: list[int]) -> Proxy:
    area, moment, plain, normal = 0.0, [0.0] * 3, [0.0] * 3, [0.0] * 3
    for face in faces:
        area += surface.areas[face]
        moment = _plus(moment, surface.areas[face], surface.centroids[face])
        plain = _plus(plain, 1.0, surface.centroids[face])
        normal = _plus(normal, surface.areas[face], surface.normals[face])
    center = [x / area for x in moment] if area > 0 else [x / len(faces) for x in plain]
    if surface.metric == "l21":
        length = math.sqrt(_dot(normal, normal))
        cancels = not length > 1e-9 * area
        return Proxy(center, [0.0] * 3 if cancels else [x / length for x in normal])
    moments = [[0.0] * 3 for _ in range(3)]
    for face in faces:
        a, b, c = (_minus(corner, center) for corner in surface.corners[face])
        for p in (a, b, c, _plus(_plus(a, 1.0, b), 1.0, c)):
            for i in range(3):
                for j in range(3):
                    moments[i][j] += surface.areas[face] * (p[i] * p[j])
    return Proxy(center, _least_axis(moments))


def _least_axis(m: Matrix) -> Vector:
    """The unit eigenvector of the smallest eigenvalue, by Jacobi's method."""
    trace = m[0][0] + m[1][1] + m[2][2]
    if not trace > 0:
        return [0.0] * 3
    axes = np.eye(3).tolist()
    for _ in range(16):
        if abs(m[0][1]) + abs(m[0][2]) + abs(m[1][2]) <= 1e-20 * trace:
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            _rotate(m, axes, p, q)
    least = min(range(3), key=lambda axis: m[axis][axis])
    return [row[least] for row in axes]


def _rotate(m: Matrix, axes: Matrix, p: int, q: int) -> None:
    if m[p][q] == 0:
        return
    theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q])
    root = abs(theta) + math.sqrt(theta * theta + 1.0)
    tangent = -1.0 / root if theta < 0 else 1.0 / root
    cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    m[p][p] -= tangent * m[p][q]
    m[q][q] += tangent * m[p][q]
    m[p][q] = m[q][p] = 0.0
    other = m[3 - p - q]
    for row in (other, *axes):
        row[p], row[q] = cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]
    m[p][3 - p - q], m[q][3 - p - q] = other[p], other[q]


def _integral(a: float, b: float, c: float) -> float:
    """Integral of the square of a linear function over a triangle of area 6."""
    return a * a + b * b + c * c + a * b + a * c + b * c


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def _plus(a: Vector, weight: float, b: Vector) -> Vector:
    return [x + weight * y for x, y in zip(a, b, strict=True)]
