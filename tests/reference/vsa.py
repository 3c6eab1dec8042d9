"""Slow, readable version of `variational_shape_approximation`, for comparisons in tests."""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from superfacets.base.types import Array, Floats
from superfacets.mesh.meshes import Mesh

from .arithmetic import dot
from .cells import build_face_graph, measure_faces
from .weights import unit_normals

Matrix = list[list[float]]


class Proxy(NamedTuple):
    """Plane that approximates a region. If the normal is 0, the proxy is a point."""

    center: Floats
    normal: Floats


class State(NamedTuple):
    """Labels of faces, and the seed and the proxy (plane) of each region, after a flood fill."""

    labels: list[int]
    seeds: list[int]
    proxies: list[Proxy]


class Surface:
    """Positions, areas, normals and neighbors of faces, and the error metric: "l2" or "l21"."""

    def __init__(self, mesh: Mesh, metric: str, *, weld: bool = True) -> None:
        self.metric = metric
        self.corners: Floats = mesh.vertices[mesh.faces]
        self.centroids, self.areas = measure_faces(mesh)
        self.normals = unit_normals(mesh)
        self.neighbors: list[list[int]] = [[] for _ in self.areas]
        for arc in build_face_graph(mesh, weld=weld):
            self.neighbors[arc.face].append(arc.neighbor)

    def own_proxy(self, face: int) -> Proxy:
        """Return the plane of a face as a proxy for a region."""
        return Proxy(self.centroids[face], self.normals[face])


def approximate(
    surface: Surface, k: int, seeds: list[int] | None, max_num_iter: int
) -> tuple[State, int, str]:
    """Run the algorithm; return the last state, the number of iterations, and the stop reason.

    If `seeds` is None, the algorithm starts with one seed, and inserts one region at a time until
    there are k regions.
    """
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
    """Grow regions from seeds, and return the resulting state.

    The next face is the queued face with the smallest error. If errors are equal, the face that was
    queued first is used. Each connected component without a seed gets one.
    """
    seeds, proxies = list(seeds), list(proxies)
    errors = [errors_of(surface, proxy).tolist() for proxy in proxies]
    labels = [-1] * len(surface.areas)
    queue: list[tuple[float, int, int, int]] = []  # error, position in the queue, face, label
    n_queued = 0
    started: list[int] = []  # newly labeled faces, whose neighbors must be queued
    for label, seed in enumerate(seeds):
        labels[seed] = label
        started.append(seed)
    while True:
        for face in started:
            label = labels[face]
            for neighbor in surface.neighbors[face]:
                heapq.heappush(queue, (errors[label][neighbor], n_queued, neighbor, label))
                n_queued += 1
        started = []
        if queue:
            _, _, face, label = heapq.heappop(queue)
            if labels[face] == -1:
                labels[face] = label
                started = [face]
        elif -1 in labels:  # a connected component has no seed
            orphan = labels.index(-1)
            labels[orphan] = len(seeds)
            started = [orphan]
            seeds.append(orphan)
            proxies.append(surface.own_proxy(orphan))
            errors.append(errors_of(surface, proxies[-1]).tolist())
        else:
            return State(labels, seeds, proxies)


def _insert(surface: Surface, state: State) -> State:
    """Add a region. Its seed is the face with the largest error in the worst region.

    The worst region has the largest total error of all regions with at least two faces. The old
    seed of the worst region is not chosen.
    """
    proxies = fit(surface, state.labels)
    seeds = _least_faces(surface, state.labels, proxies)
    errors = _own_errors(surface, state.labels, proxies)
    totals = np.bincount(state.labels, errors)  # adds in the order of faces
    sizes = np.bincount(state.labels)
    worst = max((r for r in range(len(seeds)) if sizes[r] >= 2), key=lambda r: float(totals[r]))
    members = [face for face, label in enumerate(state.labels) if label == worst]
    members.remove(seeds[worst])
    seed = max(members, key=lambda face: (errors[face], face))
    return flood(surface, [*seeds, seed], [*proxies, surface.own_proxy(seed)])


def _own_errors(surface: Surface, labels: list[int], proxies: list[Proxy]) -> Floats:
    errors = np.array([errors_of(surface, proxy) for proxy in proxies])
    return np.asarray(errors[labels, np.arange(len(labels))])


def _least_faces(surface: Surface, labels: list[int], proxies: list[Proxy]) -> list[int]:
    """Return, for each region, the face with the smallest error among its faces with a normal.

    If no face of a region has a normal, all of its faces are considered.
    """
    has_no_normal = np.asarray(~surface.normals.any(axis=1))
    regions = np.array(labels)
    ranks = (_own_errors(surface, labels, proxies), has_no_normal.astype(int), regions)
    order = np.lexsort(ranks)
    firsts = np.unique(regions[order], return_index=True)[1]
    found: list[int] = order[firsts].tolist()
    return found


def errors_of(surface: Surface, proxy: Proxy) -> Floats:
    """Return the error of each face with respect to `proxy`, shape (F,)."""
    areas, normals = surface.areas, surface.normals
    if surface.metric == "l21":
        differences = normals - proxy.normal
        squares = dot(differences, differences) if proxy.normal.any() else 2.0
        return np.where(normals.any(axis=1), areas * squares, 0.0)
    steps = surface.corners - proxy.center
    if proxy.normal.any():
        return np.asarray(areas / 6.0 * _integrals(dot(steps, proxy.normal)))
    x, y, z = (_integrals(steps[..., axis]) for axis in range(3))
    return np.asarray(areas / 6.0 * (x + y + z))


def fit(surface: Surface, labels: list[int]) -> list[Proxy]:
    """Return the proxy (plane) with the smallest error for each region."""
    regions = np.array(labels)
    return [_fit_one(surface, np.flatnonzero(regions == r)) for r in range(max(labels) + 1)]


def _fit_one(surface: Surface, faces: Array) -> Proxy:
    areas, centroids = surface.areas[faces, None], surface.centroids[faces]
    area = float(_total(areas)[0])
    center = _total(areas * centroids) / area if area > 0 else _total(centroids) / len(faces)
    if surface.metric == "l21":
        normal = _total(areas * surface.normals[faces])
        length = math.sqrt(dot(normal, normal))
        return Proxy(center, normal / length if length > 1e-9 * area else np.zeros(3))
    a, b, c = (surface.corners[faces, corner] - center for corner in range(3))
    steps = np.stack([a, b, c, a + b + c], axis=1)
    products = areas[..., None, None] * (steps[..., :, None] * steps[..., None, :])
    return Proxy(center, np.array(_least_axis(_total(products.reshape(-1, 3, 3)).tolist())))


def _total(rows: Floats) -> Floats:
    """Return the sum of all rows, added in order from the first to the last."""
    return np.asarray(np.cumsum(rows, axis=0)[-1])


def _least_axis(m: Matrix) -> list[float]:
    """Return the unit eigenvector of the smallest eigenvalue of m (3 x 3, symmetric).

    Returns 0 if the trace of m is not positive. Jacobi rotations change m in place.
    """
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


def _integrals(values: Floats) -> Floats:
    """Return the integral of f^2 over a triangle of area 6, for each row of `values`.

    f is the linear function that has these values at the three corners.
    """
    a, b, c = values[..., 0], values[..., 1], values[..., 2]
    return np.asarray(a * a + b * b + c * c + a * b + a * c + b * c)
