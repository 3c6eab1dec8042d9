"""Register the accessor ``dataset.superfacets`` in PyVista."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pyvista

from ..base.checks import compact_partial_labels
from ..base.lazy import load
from .attach import DEFAULT_NAME, attach_labels, first_face
from .convert import as_mesh

if TYPE_CHECKING:
    from ..clustering.result import Segmentation


class SuperfacetsAccessor:
    """Accessor ``dataset.superfacets`` of the datasets of PyVista 0.48 or newer.

    If this package is installed, PyVista finds the accessor by an entry point, so no import is
    necessary. If the package is on the path but not installed, import this module.

    Parameters
    ----------
    dataset : pyvista.DataSet
        A ``PolyData`` with faces or only points, or an ``UnstructuredGrid`` of tetrahedra. Methods
        raise a TypeError for other datasets; convert them with ``extract_surface()``.

    Examples
    --------
    >>> import pyvista
    >>> sphere = pyvista.Sphere()
    >>> result = sphere.superfacets.segment(20)
    >>> result.n_segments, int(sphere.cell_data["superfacets"].max())
    (20, 19)
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def segment(
        self,
        n_segments: int | None = None,
        *,
        name: str = DEFAULT_NAME,
        colors: bool = False,
        **options: Any,
    ) -> Segmentation:
        """Segment the dataset, store the labels in the dataset, and return the result.

        Parameters
        ----------
        n_segments : int, optional
            Same as in `superfacets.segment`.
        name : str, default "superfacets"
            Name of the array in ``cell_data``, or in ``point_data`` if there are only points.
        colors : bool, default False
            Whether colors are also stored, under ``f"{name}_colors"``. Show them with
            ``dataset.plot(scalars=f"{name}_colors", rgb=True)``.
        **options
            Further arguments of `superfacets.segment`.
        """
        segment = load("superfacets.pipeline:segment")
        result: Segmentation = segment(self._dataset, n_segments, **options)
        self.attach(result, name=name, colors=colors)
        return result

    def attach(
        self, labels: npt.ArrayLike, *, name: str = DEFAULT_NAME, colors: bool = False
    ) -> None:
        """Store labels of faces, tetrahedra or points; see `superfacets.attach_labels`."""
        attach_labels(self._dataset, labels, name=name, colors=colors)

    def borders(self, name: str = DEFAULT_NAME) -> Any:
        """Return the edges between regions as lines of a new ``PolyData``.

        Parameters
        ----------
        name : str, default "superfacets"
            Name of the array of labels in ``cell_data``.

        Raises
        ------
        MeshError
            If the dataset has no faces.
        KeyError
            If ``cell_data`` has no array with this name.
        """
        mesh = as_mesh(self._dataset)
        first = first_face(self._dataset)
        stored = np.asarray(self._dataset.cell_data[name])
        labels, _ = compact_partial_labels(stored[first : first + mesh.n_faces], mesh.n_faces)
        graph = load("superfacets.graph.face_graph:build_face_graph")(mesh)
        ends = load("superfacets_show.scene:border_edges")(mesh, graph, labels)
        used, lines = np.unique(ends, return_inverse=True)
        lines = np.insert(lines.reshape(-1, 2), 0, 2, axis=1)
        return pyvista.PolyData(mesh.vertices[used], lines=lines.ravel())


pyvista.register_dataset_accessor("superfacets", pyvista.DataSet)(SuperfacetsAccessor)
