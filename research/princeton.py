"""Read the Princeton Segmentation Benchmark.

The benchmark has 380 models in 19 categories of 20 models. About eleven people segmented each model
(Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009). The folder of the
benchmark contains the mesh ``off/N.off`` of model N, and its segmentations
``seg/Benchmark/N/N_j.seg``, called ground truths. Some models may be missing.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from superfacets.base.errors import MeshError
from superfacets.base.types import Ints
from superfacets.files.readers.labels import read_labels
from superfacets.files.readers.read import read_mesh
from superfacets.mesh.meshes import Mesh

from .checks import as_triangles

__all__ = ["CATEGORIES", "Benchmark", "Model", "category_of"]

_SHELVES = (
    "Human", "Cup", "Glasses", "Airplane", "Ant", "Chair", "Octopus", "Table", "Teddy", "Hand",
    "Plier", "Fish", "Bird", "", "Armadillo", "Bust", "Mech", "Bearing", "Vase", "Fourleg",
)  # fmt: skip
"""Category of models 1 to 20, of models 21 to 40, and so on; empty for 261 to 280 (no models)."""

CATEGORIES = tuple(name for name in _SHELVES if name)
"""Names of the 19 categories, in the order of their models."""

_MODELS_PER_CATEGORY = 20


def category_of(number: int) -> str:
    """Return the category of a model of the benchmark.

    Raises
    ------
    ValueError
        If `number` is not in 1 to 260 or 281 to 400.

    Examples
    --------
    >>> category_of(1), category_of(20), category_of(281), category_of(400)
    ('Human', 'Human', 'Armadillo', 'Fourleg')
    """
    shelf = (number - 1) // _MODELS_PER_CATEGORY
    if not (0 <= shelf < len(_SHELVES) and _SHELVES[shelf]):
        raise ValueError(f"model must be 1 to 260 or 281 to 400, got {number}")
    return _SHELVES[shelf]


@dataclass(frozen=True, eq=False)
class Model:
    """A model of the benchmark, and segmentations of this model by several people.

    Attributes
    ----------
    number : int
    category : str
    mesh : Mesh
    ground_truths : tuple of ndarray of int32, shape (F,)
        One array for each readable file ``N_j.seg``, in ascending order of j. It contains the
        segment number of each face.
    problems : tuple of str
        Messages about ground truths that are left out, because their files are missing or damaged,
        or do not fit the mesh. If the model has no ground truths, a message says so.
    """

    number: int
    category: str
    mesh: Mesh
    ground_truths: tuple[Ints, ...]
    problems: tuple[str, ...]


class Benchmark:
    """Folder with all or some models of the benchmark.

    Parameters
    ----------
    root : path-like
        Folder that contains the folders ``off`` and ``seg``.

    Attributes
    ----------
    numbers : tuple of int
        Numbers N of the models that have a mesh file ``off/N.off``, in ascending order. Other files
        in ``off`` are ignored.

    Raises
    ------
    MeshError
        If the folder does not exist or contains no model.
    """

    def __init__(self, root: str | os.PathLike[str]) -> None:
        self.root = Path(root)
        meshes = self.root / "off"
        if not meshes.is_dir():
            raise MeshError(
                f"{self.root} is not a copy of the Princeton benchmark: it has no folder 'off'"
            )
        names = (re.fullmatch(r"([1-9]\d*)\.off", path.name) for path in meshes.iterdir())
        self.numbers = tuple(sorted(int(name[1]) for name in names if name))
        if not self.numbers:
            raise MeshError(f"{meshes} contains no model: expected files such as 1.off")

    def path_of(self, number: int) -> Path:
        """Return the path of the mesh file of a model."""
        return self.root / "off" / f"{number}.off"

    def load(self, number: int) -> Model:
        """Read a model and its ground truths.

        Raises
        ------
        MeshError
            If the mesh is not valid. An invalid ground truth is not an error; it is left out, with
            a message in `problems`.
        OSError
            If the mesh file does not exist or cannot be read.
        ValueError
            If `number` is not in 1 to 260 or 281 to 400.
        """
        category = category_of(number)
        mesh = as_triangles(read_mesh(self.path_of(number)))
        truths, problems = [], []
        for path in self._truth_files(number):
            try:
                truths.append(read_labels(path, mesh.n_faces))
            except MeshError as error:
                problems.append(str(error))
            except OSError as error:
                reason = "no such file" if isinstance(error, FileNotFoundError) else str(error)
                problems.append(f"{path}: {reason}")
        if not truths and not problems:
            problems.append(f"{self._truth_folder(number)}: there are no ground truths")
        return Model(number, category, mesh, tuple(truths), tuple(problems))

    def _truth_folder(self, number: int) -> Path:
        return self.root / "seg" / "Benchmark" / str(number)

    def _truth_files(self, number: int) -> list[Path]:
        """Return the paths of all files from N_0.seg to the last existing N_j.seg.

        Files before the last one may be missing; their paths are included.
        """
        pattern = re.compile(rf"{number}_(\d+)\.seg")
        folder = self._truth_folder(number)
        names = (pattern.fullmatch(path.name) for path in folder.glob("*.seg"))
        last = max((int(name[1]) for name in names if name), default=-1)
        return [folder / f"{number}_{j}.seg" for j in range(last + 1)]
