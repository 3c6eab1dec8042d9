"""Check arguments of the methods for comparison, and import the packages that they need."""

from __future__ import annotations

import importlib
import operator
from typing import Any

import numpy as np

from superfacets import Mesh, MeshError
from superfacets.base.checks import counted
from superfacets.base.errors import MissingExtraError
from superfacets.mesh.convert import MeshLike, as_mesh


class MissingGroupError(MissingExtraError):
    """A package of the dependency group research is missing."""

    def __init__(self, task: str) -> None:
        """Create an error that says that `task` needs the group."""
        advice = "pip install --group research, and pip install research/vsa_core"
        ImportError.__init__(self, f"{task} needs more packages: {advice}")


def import_package(module: str, task: str) -> Any:
    """Import a module; if it is missing, raise a MissingGroupError that names `task`."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise MissingGroupError(task) from None


def checked_generator(value: Any, name: str) -> np.random.Generator:
    """Return `value` if it is a random number generator, or make one if it is a seed >= 0."""
    if isinstance(value, np.random.Generator):
        return value
    if isinstance(value, (bool, np.bool_, np.ndarray)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be an integer or a Generator, got {value!r}")
    seed = operator.index(value)
    if seed < 0:
        raise ValueError(f"{name} must not be negative, got {seed}")
    return np.random.default_rng(seed)


def as_triangles(source: MeshLike) -> Mesh:
    """Convert `source` to a `Mesh`; raise a MeshError if a face is not a triangle."""
    mesh = as_mesh(source)
    if isinstance(mesh, Mesh):
        return mesh
    sizes = mesh.sizes
    if (sizes == 3).all():
        return Mesh._of_new(mesh.vertices, mesh.indices.reshape(-1, 3))
    first = int(np.argmax(sizes != 3))
    corners = counted(int(sizes[first]), "corner")
    raise MeshError(
        f"faces must be triangles, but faces[{first}] has {corners}: call"
        " PolygonMesh.triangulate() first"
    )
