"""Find and load meshes for studies: models of the benchmark, and mesh files of the user."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from superfacets.base.errors import MeshError
from superfacets.base.types import Array, Ints
from superfacets.files.formats import FORMATS
from superfacets.files.readers.read import read_mesh
from superfacets.mesh.convert import as_mesh
from superfacets.mesh.faces import FaceMesh, corners_of
from superfacets.metrics import GroundTruths

from .princeton import Benchmark, Model


@dataclass(frozen=True)
class StudyMesh:
    """A model of the benchmark or a mesh file of the user. The mesh is read by `load`."""

    name: str  # number of the model as text, or name of the file
    path: Path  # root folder of the benchmark, or path of the mesh file of the user
    category: str  # category in the benchmark; empty for a mesh file of the user
    n_faces: int  # number of faces of the mesh
    n_ground_truths: int  # number of segmentations by people; 0 for a mesh file of the user
    digest: str  # hash of the content of the mesh and its ground truths
    number: int = 0  # number of the model in the benchmark, from 1; 0 for a mesh of the user

    @property
    def is_model(self) -> bool:
        """Whether this is a model of the benchmark. Only models have ground truths."""
        return self.number > 0


@dataclass(frozen=True)
class StudyMeshes:
    """Meshes sorted by number of faces, and messages about files that are missing or not used."""

    found: tuple[StudyMesh, ...]
    problems: tuple[str, ...]


def find_models(root: Path, numbers: Iterable[int] | None = None) -> StudyMeshes:
    """Return the models of a benchmark that have ground truths: all, or only those in `numbers`.

    Raises MeshError if no model can be used, and ValueError if a model in `numbers` does not exist.
    """
    benchmark = Benchmark(root)
    found, problems = [], []
    wanted = benchmark.numbers if numbers is None else sorted(set(numbers))
    if missing := sorted(set(wanted) - set(benchmark.numbers)):
        raise ValueError(f"{root} has no model {missing[0]}")
    for number in wanted:
        try:
            model = benchmark.load(number)
        except (ValueError, OSError) as error:
            problems.append(f"model {number} is left out: {error}")
            continue
        problems += model.problems
        if not model.ground_truths:
            problems.append(f"model {number} is left out: it has no ground truth")
            continue
        digest = _digest(model.mesh, model.ground_truths)
        n_truths = len(model.ground_truths)
        found.append(
            StudyMesh(
                str(number), root, model.category, model.mesh.n_faces, n_truths, digest, number
            )
        )
    if not found:
        raise MeshError(f"{root}: no model can be used: {problems[0]}")
    return StudyMeshes(_by_size(found), tuple(problems))


def find_meshes(folder: Path) -> StudyMeshes:
    """Return the readable mesh files of a folder, and messages about unreadable mesh files."""
    found, problems = [], []
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in FORMATS.meshes:
            continue
        try:
            mesh = as_mesh(read_mesh(path))
        except (MeshError, OSError) as error:
            problems.append(f"{path.name} is left out: {error}")
        else:
            found.append(StudyMesh(path.name, path, "", mesh.n_faces, 0, _digest(mesh, ())))
    return StudyMeshes(_by_size(found), tuple(problems))


@lru_cache(maxsize=1)  # consecutive tasks mostly use the same mesh
def load(source: StudyMesh) -> tuple[FaceMesh, GroundTruths]:
    """Return the mesh of a source and its ground truths, which only models have.

    Raises a MeshError if the files of a model have changed since `find_models`.
    """
    if not source.is_model:
        mesh = as_mesh(read_mesh(source.path))
        return mesh, GroundTruths(mesh, (), n_threads=1)
    model = load_model(source)
    return model.mesh, GroundTruths(model.mesh, model.ground_truths, n_threads=1)


def load_model(source: StudyMesh) -> Model:
    """Return a model; raise a MeshError if its files have changed since `find_models`."""
    model = Benchmark(source.path).load(source.number)
    if _digest(model.mesh, model.ground_truths) != source.digest:
        raise MeshError(f"the files of model {source.name} changed during the run: start it again")
    return model


def _by_size(sources: list[StudyMesh]) -> tuple[StudyMesh, ...]:
    return tuple(sorted(sources, key=lambda source: (source.n_faces, source.number, source.name)))


def _digest(mesh: FaceMesh, ground_truths: Iterable[Ints]) -> str:
    hashed = hashlib.blake2b(digest_size=16)
    corners = corners_of(mesh)
    sizes = np.diff(corners.starts)
    arrays: tuple[Array, ...] = (mesh.vertices, sizes, corners.vertices, *ground_truths)
    for array in arrays:
        hashed.update(str(array.shape).encode())
        hashed.update(np.ascontiguousarray(array).tobytes())
    return hashed.hexdigest()
