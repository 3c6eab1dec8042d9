"""Cells with labels and colors, in files that hold a mesh or a cloud."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ..._validate import refuse_mask
from ...errors import MeshError
from ...mesh.faces import AnyCells, FaceMesh, n_cells_of, noun_of
from ...mesh.point_cloud import PointCloud
from ...mesh.tet_mesh import TetMesh
from ..attributes import MeshAttributes
from .clouds import CLOUD_WRITERS
from .glb import write_glb
from .obj import write_obj
from .off import write_off
from .ply import write_ply
from .tets import TET_OUTPUTS, write_tets
from .vtp import write_vtp

__all__ = [
    "ATTRIBUTE_OUTPUTS",
    "CLOUD_OUTPUTS",
    "MESH_OUTPUTS",
    "CellWriter",
    "FormatOptions",
    "usual_ending",
]

FACE_WRITERS: dict[str, Callable[..., None]] = {
    ".ply": write_ply,
    ".vtp": write_vtp,
    ".obj": write_obj,
    ".off": write_off,
    ".glb": write_glb,
}

MESH_OUTPUTS = (*FACE_WRITERS, *TET_OUTPUTS)
CLOUD_OUTPUTS = (".csv", ".las", ".laz")
"""Of point clouds alone."""

ATTRIBUTE_OUTPUTS = (".ply", ".vtp", ".las", ".laz")
"""Files that have a place for attributes of vertices and faces."""

NAMED_OUTPUTS = (".vtp", *TET_OUTPUTS)
"""Files whose array of labels may have any name."""

CLASS_OUTPUTS = (".glb", ".aggregation.json")

COLORLESS_OUTPUTS = (".obj", ".csv")
"""Files that have no place for colors, which take a while to find."""


@dataclass(frozen=True)
class FormatOptions:
    """What formats leave a choice in.

    Parameters
    ----------
    ascii : bool
        Text instead of binary.
    label_name : str
        Name of the array of labels in files of VTK.
    vertex_labels : bool
        Whether a PLY has labels of its vertices, too.
    classes : tuple of str, optional
        One for each label that occurs, in their order.
    """

    ascii: bool = False
    label_name: str = "label"
    vertex_labels: bool = False
    classes: tuple[str, ...] | None = None

    @classmethod
    def checked(
        cls,
        endings: Sequence[str],
        *,
        ascii: bool = False,
        label_name: str = "label",
        vertex_labels: bool = False,
        classes: Sequence[str] | Sequence[int] | None = None,
    ) -> FormatOptions:
        """Return the options; a ValueError if a value is wrong, or no file has a use for one."""
        if not isinstance(label_name, str) or not label_name or not label_name.isprintable():
            raise ValueError(f"label_name must be a line of text, got {label_name!r}")
        for name, is_given, fitting in (
            ("label_name", label_name != "label", NAMED_OUTPUTS),
            ("vertex_labels", vertex_labels, (".ply",)),
            ("classes", classes is not None, CLASS_OUTPUTS),
        ):
            if is_given and not {*endings} & {*fitting}:
                raise ValueError(f"{name} is for {', '.join(fitting)}: no such file is written")
        names = None if classes is None else tuple(map(_checked_class, classes))
        return cls(ascii, label_name, vertex_labels, names)

    def check_classes(self, labels: npt.NDArray[np.int32] | None) -> None:
        """Raise a ValueError if there are classes, but not one for each label."""
        if self.classes is None:
            return
        if labels is None:
            raise MeshError("classes are of regions, and there are no labels")
        n_regions = len(np.unique(labels[labels >= 0]))
        if len(self.classes) != n_regions:
            raise MeshError(f"there are {len(self.classes)} classes for {n_regions} regions")


def _checked_class(value: object) -> str:
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (str, int, np.integer)):
        raise TypeError(f"classes must be names or whole numbers, got {value!r}")
    return str(value)


@dataclass(frozen=True)
class CellWriter:
    """Cells and what goes with them, to be written to files of any format."""

    cells: AnyCells
    labels: npt.NDArray[np.int32] | None
    given_colors: Any
    attributes: MeshAttributes | None
    options: FormatOptions

    def checked(self, endings: Sequence[str]) -> CellWriter:
        """Return self; an error if files with these endings could not be written."""
        if not endings:
            return self
        for ending in endings:
            _check_kind(self.cells, ending)
        self.options.check_classes(self.labels)
        if isinstance(self.cells, TetMesh):
            if self.given_colors is not None or self.attributes is not None:
                raise ValueError("files of tetrahedra hold labels: leave out colors and attributes")
            return self
        _check_attributes(self.attributes, self.cells)
        if self.options.vertex_labels and (self.labels is None or not _has_faces(self.cells)):
            raise MeshError("vertex_labels needs faces with labels")
        colors = _checked_colors(self.given_colors, self.cells)
        return replace(self, given_colors=colors)

    def write(self, file: IO[bytes], ending: str, path: Path | None = None) -> None:
        """Write a file that ends so."""
        cells, labels, options = self.cells, self.labels, self.options
        if isinstance(cells, TetMesh):
            name = options.label_name
            write_tets(file, cells, labels, ending, ascii=options.ascii, label_name=name)
            return
        colors = self.given_colors if ending in COLORLESS_OUTPUTS else self._colors
        write = (CLOUD_WRITERS if isinstance(cells, PointCloud) else FACE_WRITERS)[ending]
        keywords: dict[str, Any] = {"ascii": options.ascii, "attributes": self.attributes}
        if ending == ".vtp":
            keywords["label_name"] = options.label_name
        if ending == ".glb":
            keywords["classes"] = options.classes
        if ending == ".ply" and options.vertex_labels:
            from ...regions.vertices import vertex_labels

            assert labels is not None
            keywords["vertex_labels"] = vertex_labels(cells, labels)
        write(file, cells, labels, colors, **keywords)

    @cached_property
    def _colors(self) -> npt.NDArray[np.uint8] | None:
        """The colors as given, or those of the labels, or None where there are neither."""
        if self.given_colors is not None or self.labels is None:
            return self.given_colors  # type: ignore[no-any-return]  # checked
        from ...pictures.colors import face_colors

        return face_colors(self.cells, self.labels)


def usual_ending(*, of_tets: bool) -> str:
    """The ending of files with labels where none is asked for."""
    return ".vtu" if of_tets else ".ply"


def _has_faces(cells: AnyCells) -> bool:
    return not isinstance(cells, (PointCloud, TetMesh))


def _check_kind(mesh: AnyCells, ending: str) -> None:
    """Raise a MeshError if files of this kind hold other cells."""
    fitting: tuple[str, ...] = tuple(FACE_WRITERS)
    if isinstance(mesh, PointCloud):
        fitting = tuple(CLOUD_WRITERS)
    elif isinstance(mesh, TetMesh):
        fitting = TET_OUTPUTS
    if ending not in fitting:
        what = "tetrahedra" if isinstance(mesh, TetMesh) else f"{noun_of(mesh)}s"
        listed = f"{', '.join(fitting[:-1])} or {fitting[-1]}"
        raise MeshError(f"{what} are written as {listed}, not as {ending}")


def _checked_colors(colors: Any, mesh: FaceMesh | PointCloud) -> npt.NDArray[np.uint8] | None:
    if colors is None:
        return None
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    n_cells = n_cells_of(mesh)
    if array.shape != (n_cells, 3):
        raise ValueError(f"colors must have shape ({n_cells}, 3), got {array.shape}")
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 255:
        raise ValueError("colors must be integers from 0 to 255")
    return array.astype(np.uint8)


def _check_attributes(attributes: Any, mesh: FaceMesh | PointCloud) -> None:
    """Raise an error where they are no attributes, or not of this mesh."""
    if attributes is None:
        return
    if not isinstance(attributes, MeshAttributes):
        raise TypeError(f"attributes must be MeshAttributes, got {type(attributes).__name__}")
    if isinstance(mesh, PointCloud):
        n_vertices, n_faces = mesh.n_points, 0
    else:
        n_vertices, n_faces = mesh.n_vertices, mesh.n_faces
    owners: tuple[tuple[str, Mapping[str, npt.NDArray[Any]], int], ...] = (
        ("vertex", attributes.vertex, n_vertices),
        ("face", attributes.face, n_faces),
    )
    for owner, values, n_rows in owners:
        for name, array in values.items():
            if len(array) != n_rows:
                raise ValueError(
                    f"the {owner} property {name} has {len(array)} values for {n_rows} in the mesh"
                )
