"""Write a mesh with its labels, or only labels; incomplete output files never appear."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Ints, Longs
from ...graph.constraints import ConstraintOptions
from ...graph.kinds import fit_vertices, kind_of, of_cells
from ...mesh.attributes import MeshAttributes
from ...mesh.base import Cells
from ...mesh.convert import as_cells
from ...regions.vertices import MIN_IN_FILES, groups_of_result, parents_of
from ..atomic import StrPath, atomic_outputs, checked_targets
from ..formats import FORMATS
from ..guards import known_ending
from ..readers.labels import checked_labels
from .cells import NEW, CellWriter, FormatOptions
from .ids import LEVELS, SEGMENTS, IdWriter


def write_mesh(
    path: StrPath, mesh: Any, labels: npt.ArrayLike | None = None, *,
    colors: npt.ArrayLike | None = None, attributes: MeshAttributes | None = None,
    ascii: bool = False, label_name: str = "label", vertex_labels: bool = False,
    classes: Sequence[str] | Sequence[int] | None = None, scores: npt.ArrayLike | None = None,
    force: bool = False,
) -> None:  # fmt: skip
    """Write a mesh, with labels and colors of its faces, in the format of the file's ending.

    A warning names attributes that a format does not store. The user guide (Export) has details.

    Parameters
    ----------
    path : path-like
        Output file. The ending selects the format:

        - faces: ``.ply``, ``.vtp``, ``.obj`` (one group per region or class), ``.stl`` (triangles;
          text with one solid per region or class; binary without labels), ``.off`` (colors),
          ``.glb`` (region ids and a table of regions) or ``.ids.png`` (the region id of each texel;
          `attributes` must contain a texture);
        - tetrahedra: ``.vtu`` or ``.vtk``, without colors;
        - points: ``.ply``, ``.pcd``, ``.csv``, ``.las`` or ``.laz`` (with the extra ``las``);
        - one id per vertex (from `vertex_labels` with ``method="creases"`` and ``min_vertices=20``;
          vertices in no face get new ids, as in ``.npz``) or point: ``.segs.json``, ``.bin``,
          ``_sp_label.npy`` or ``.pth`` (which needs torch);
        - one label per vertex of a brain cortex: ``.label.gii`` (GIFTI) or ``.annot`` (FreeSurfer);
        - ``.sstk.json`` (one label per triangle), ``.aggregation.json`` (one group per region), or
          ``.npz`` (the arrays of `RegionGraph.to_pyg` and ``region``, the label of each node; for
          meshes, nodes are superpoints, and ``vertex_super_index`` is the node of each vertex).

        An existing file is replaced when the new file is complete, and its permissions are kept.
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, mesh-like or cloud-like
        Polygons stay polygons, except in GLB. For a cloud, there is one label and one color per
        point; LAS stores the labels in an extra dimension ``label``.
    labels : array_like of integers, shape (F,), optional
        Region of each face, 0 or greater; -1 if a face is in no region. Formats with one id or
        label per vertex, ``.npz``, ``.aggregation.json`` and PLY with `vertex_labels` also store
        given labels of vertices, (V,).
    colors : array_like of uint8, shape (F, 3), optional
        Red, green and blue of each face. With labels, the default is the result of `face_colors`.
    attributes : MeshAttributes, optional
        Other properties of vertices and faces. Properties that the writer adds itself, such as
        ``label`` or ``red``, are skipped.
    ascii : bool, default False
        Whether to write text instead of binary numbers.
    label_name : str, default "label"
        Name of the label array in VTP, VTU and VTK; dental tools expect ``Label``.
    vertex_labels : bool, default False
        Whether a PLY file also has a vertex property ``label``, given or from
        `superfacets.vertex_labels`.
    classes : sequence of str or int, length K, optional
        Class of each region, in ascending order of the labels: a column of the table in GLB, and
        names of groups in OBJ, solids in STL, areas in ``.label.gii`` and ``.annot``, and labels of
        groups in ``.aggregation.json``.
    scores : array_like of float, length K, optional
        Score of each region, 0 to 1, in ascending order of the labels, for example
        `LiftedLabels.label_scores`. Only ``.aggregation.json`` stores scores.
    force : bool, default False
        Whether to replace an ``.aggregation.json`` or ``.segs.json`` file of another program, or a
        ``.segs.json`` file whose segments an ``.aggregation.json`` file in the same folder uses.
        See `regroup_segments`.

    Raises
    ------
    ValueError
        If the ending, a shape or a dtype is wrong, if a label is below -1, or -1 in a format whose
        ids begin at 0, or if the format cannot store the cells, their number, or an option.
    TypeError
        If `attributes` is neither a `MeshAttributes` nor None, or if a class is neither a string
        nor an integer.
    MissingExtraError
        If the format needs a package that is not installed.
    OSError
        If the file cannot be written. The error is a FileExistsError if `force` is needed.

    Examples
    --------
    >>> from pathlib import Path
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> write_mesh("square.ply", square, colors=[[255, 0, 0], [0, 0, 255]], ascii=True)
    >>> print(Path("square.ply").read_text().splitlines()[-1])
    3 0 2 3 0 0 255 255
    """
    endings = (*FORMATS.cell_outputs, *FORMATS.id_outputs, *FORMATS.graph_outputs)
    ending = known_ending(path, endings)
    options = FormatOptions.checked(
        [ending], ascii=ascii, label_name=label_name, vertex_labels=vertex_labels,
        classes=classes, scores=scores, force=force,
    )  # fmt: skip
    written = OutputFiles([path], options).write(mesh, labels, colors=colors, attributes=attributes)
    for note in written.notes():
        warnings.warn(note, stacklevel=2)


def _check_truth_stays(paths: Sequence[StrPath], force: bool) -> None:
    """Raise a FileExistsError if writing would destroy ground truth of scans, unless `force`."""
    if not force and any(Path(path).suffix.lower() == ".json" for path in paths):
        load("superfacets_scans.scannet:check_truth_stays")(paths)


def write_labels(path: StrPath, labels: npt.ArrayLike, *, force: bool = False) -> None:
    r"""Write labels to a file, without a mesh.

    Parameters
    ----------
    path : path-like
        Output file. The ending selects the format:

        - ``.npy`` (int32), ``.seg`` or ``.txt`` (one integer per line, no header);
        - labels of vertices (labels of faces need `write_mesh`, but cannot be recognized here):
          ``.segs.json``; ``.bin``, ``_sp_label.npy`` or ``.pth`` (int64, renumbered without gaps);
          ``.label.gii`` or ``.annot`` (with a table of colors and names);
        - labels of triangles: ``.sstk.json``; of segments: ``.aggregation.json`` (a group each).

        An existing file is replaced when the new file is complete, and its permissions are kept.
    labels : array_like of integers, shape (F,)
        Region of each cell, 0 or greater; -1 if a cell is in no region. Labels of vertices cannot
        be -1, except in ``.label.gii`` and ``.annot``. For ``.sstk.json`` the shape may be (n, F):
        n nested levels, the finest first.
    force : bool, default False
        Same as in `write_mesh`.

    Raises
    ------
    ValueError, MissingExtraError, OSError
        For the same reasons as in `write_mesh`; if levels are not nested; or if a label is 2**24 or
        greater in ``.segs.json``, ``.aggregation.json``, ``.label.gii`` or ``.annot``.

    Examples
    --------
    >>> from pathlib import Path
    >>> write_labels("square.seg", [0, 1])
    >>> Path("square.seg").read_text()
    '0\n1\n'
    """
    ending = known_ending(path, (*FORMATS.label_outputs, *FORMATS.id_outputs))
    path, cells = Path(path), getattr(labels, "cells", None)  # a `Segmentation` has cells
    if ending in (*FORMATS.vertex_outputs, *FORMATS.key_labels) and hasattr(cells, "n_vertices"):
        noun = kind_of(cells).noun
        raise MeshError(
            f"a {ending} file has a label per vertex, but these are labels per {noun}: convert them"
            f" with superfacets.write_mesh({str(path)!r}, mesh, labels)"
        )
    _check_truth_stays([path], force)
    are_levels = ending == LEVELS and np.ndim(labels) == 2
    levels = [*map(checked_labels, ([*np.asarray(labels)] if are_levels else ()) or [labels])]
    options = FormatOptions.checked([ending])
    writer = IdWriter(None, levels[0], options, of_vertices=levels[0], coarser=levels[1:])
    writer.checked([ending])
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        writer.write(file, ending, path)


ORDER = "the order of faces (they are sorted by region, so label files do not fit this file)"
"""Message for the data that is lost in the formats in `Formats.sorted_outputs`."""


class Written(NamedTuple):
    """Result of `OutputFiles.write`."""

    lost: dict[str, list[str]]
    """Attributes that the formats do not store, keyed by ending."""
    region_sizes: Longs
    """If ids of vertices were computed, the number of vertices of each region, in ascending order
    of the labels; otherwise an empty array."""

    def notes(self, begin: str = "") -> list[str]:
        """Return messages on data that is lost, which start with `begin`, or that is new."""
        found, endings = [], dict[str, list[str]]()
        for ending, lost in self.lost.items():
            new = [item for item in lost if item.startswith(NEW)]
            gone = [item for item in lost if item not in new]
            found += [f"{begin}{ending} does not store: {'; '.join(gone)}"] * bool(gone)
            endings.setdefault("; ".join(new), []).append(ending)
        return found + [f"in {' and '.join(endings[item])}, {item}" for item in endings if item]


@dataclass(frozen=True)
class OutputFiles:
    """Files, and open binary streams, that are written together: either all files, or none.

    Commands check outputs before a long computation with `check` and `check_fit`, and write them
    with `write`. Endings are the same as for `write_mesh` and `write_labels`; `endings` is the set
    of all endings, and `streams` maps endings to streams, which need not be seekable. Streams are
    written after all files are complete. If this fails, no file appears.
    """

    files: Sequence[StrPath]
    options: FormatOptions = field(default_factory=FormatOptions)
    streams: Mapping[str, IO[bytes]] = field(default_factory=dict)

    MIN_VERTICES: ClassVar[int] = MIN_IN_FILES
    """Number of vertices to which regions grow, if possible, in files with one id per vertex."""

    @property
    def endings(self) -> set[str]:
        """Endings of files and streams. Raises a MeshError if one is unknown."""
        return {_ending_of(Path(path)) for path in self.files} | {*self.streams}

    def check(self) -> None:
        """Check, before a long computation, whether the files can be written.

        Raises a ValueError if an ending is unknown or a path is given twice. Raises an OSError if a
        folder is missing or not writable, if a path is not a regular file, or if `force` is needed.
        """
        _check_truth_stays(self.files, self.options.force)
        for path in self.files:
            _ending_of(Path(path))
        checked_targets(self.files)

    def check_fit(self, cells: Cells, labels: Ints | None = None) -> None:
        """Raise an error, before a long computation, if a format cannot store the cells.

        `labels` stands for labels that are computed later: -1 where a cell will be in no region,
        and any label elsewhere. None means that every cell will be in a region.
        """
        likely = np.zeros(cells.n_cells, np.int32) if labels is None else of_cells(labels, cells)
        for ending in self.endings:
            _writer_of(cells, likely, ending, self.options)

    def write_one(
        self, file: IO[bytes], path: Path, cells: Cells, labels: Ints,
        attributes: MeshAttributes | None = None, constraints: Mapping[str, Any] | None = None,
        finer: Ints | None = None, of_vertices: Ints | None = None,
    ) -> list[str]:  # fmt: skip
        """Write one labeling in the format of `path`, and return the names of lost attributes.

        `constraints` are the same as in `write`. If the file has one label per vertex, its regions
        are unions of regions of `finer`, labels of a finer level: converted to labels of vertices,
        or given for vertices, too, as `of_vertices`.
        """
        ending, groups = _ending_of(path), _groups_in(constraints, cells, labels)
        if of_vertices is not None and finer is not None:
            of_vertices = parents_of(finer, labels)[of_vertices]
        own = (attributes, groups, of_vertices, finer)
        return _writer_of(cells, labels, ending, self.options, *own).write(file, ending, path)

    def write(
        self, mesh: Any, labels: npt.ArrayLike | None, *, colors: npt.ArrayLike | None = None,
        attributes: MeshAttributes | None = None, listed: npt.ArrayLike | None = None,
        listed_mesh: Any = None, of_vertices: Ints | None = None,
        segments: tuple[Ints, Ints, Path] | None = None,
        constraints: Mapping[str, Any] | None = None, weld: float = True,
    ) -> Written:  # fmt: skip
        """Write all files and streams.

        Files with one label per cell get one label per record of the input
        (`MeshAttributes.records`), -1 for records without a position; or `listed`, labels of
        `listed_mesh`, such as the mesh before subdivision. Formats with one label per vertex store
        `of_vertices` if it is given, and otherwise labels of vertices computed from labels of
        cells. Such labels do not cross `constraints`, the ``mask`` and ``barriers`` of the
        segmentation, if these have a value per vertex of the mesh, or of `listed_mesh`; by default,
        the constraints that `labels` keep. If `segments` are given, as in `IdWriter`, formats in
        `Formats.vertex_outputs` store the segments, and ``.aggregation.json`` stores groups of
        segments, and names the ``.segs.json`` file in `files`, if any. `weld` is for region graphs.

        Raises the errors of `write_mesh`, and a ValueError if a path is given twice, or if a format
        needs labels but there are none.
        """
        paths, all_endings, options = [*map(Path, self.files)], self.endings, self.options
        _check_truth_stays(paths, options.force)
        cells = as_cells(mesh)
        of_ply = (".ply",) if options.vertex_labels else ()
        stores_given = all_endings <= {*FORMATS.unconverted_outputs, *of_ply}
        if of_vertices is None and stores_given and fit_vertices(labels, cells):
            of_vertices = checked_labels(labels)
            labels = of_cells(of_vertices, cells)
        counts = (cells.n_cells, getattr(cells, "n_vertices", None))
        cell_labels = None if labels is None else checked_labels(labels, *counts)
        file = next((path for path in paths if _ending_of(path) == SEGMENTS), None)
        groups = _groups_in(constraints, cells, labels)
        ids = IdWriter(cells, cell_labels, options, attributes, of_vertices, segments, file)
        writer = CellWriter(cells, cell_labels, colors, attributes, options, of_vertices, groups)
        if listed is not None:
            of_listed = cells if listed_mesh is None else as_cells(listed_mesh)
            ids = IdWriter(of_listed, checked_labels(listed), options, segments_file=file)
            groups = _groups_in(constraints, of_listed, labels)
        ids = replace(ids, groups=groups, weld=weld)
        listing = all_endings.difference(FORMATS.cell_outputs)
        writers = dict.fromkeys(listing, ids.checked([*listing]).write)
        writers |= dict.fromkeys(others := all_endings - listing, writer.checked([*others]).write)
        records = None if attributes is None else attributes.records
        if records is not None and cell_labels is not None:  # one label per record of the file
            of_records = np.full(len(records), -1, np.int32)
            of_records[records] = cell_labels
            write = IdWriter(cells, of_records, options).write
            writers |= dict.fromkeys(all_endings & {*FORMATS.label_outputs}, write)
        lost = self._write_with(writers)
        are_sorted = cell_labels is None or (cell_labels[1:] >= cell_labels[:-1]).all()
        if not are_sorted and all_endings & {*FORMATS.label_outputs, ".sstk.json"}:
            lost |= {end: [*lost[end], ORDER] for end in FORMATS.sorted_outputs if end in lost}
        keeps_ids = of_vertices is not None or kind_of(cells).are_points
        has_ids = not keeps_ids and all_endings & {*FORMATS.vertex_outputs, *FORMATS.graph_outputs}
        return Written(lost, ids.region_sizes if has_ids else np.zeros(0, np.int64))

    def _write_with(self, writers: Mapping[str, Callable[..., list[str]]]) -> dict[str, list[str]]:
        """Write all files, and return attributes that were not stored, keyed by ending."""
        lost = {}
        with atomic_outputs(self.files) as temporaries:
            for temporary, path in zip(temporaries, map(Path, self.files), strict=True):
                ending = _ending_of(path)
                with temporary.open("wb") as file:
                    lost[ending] = writers[ending](file, ending, path)
            for ending, stream in self.streams.items():
                lost[ending] = writers[ending](stream, ending, None)
                stream.flush()
        return lost


def _groups_in(constraints: Mapping[str, Any] | None, cells: Cells, labels: object) -> Ints | None:
    if constraints is None:
        return groups_of_result(labels, cells)
    return ConstraintOptions(**constraints).groups_of_vertices(cells)


def _ending_of(path: Path) -> str:
    return known_ending(path, FORMATS.outputs)


def _writer_of(
    cells: Cells, labels: Ints | None, ending: str, form: FormatOptions,
    attributes: MeshAttributes | None = None, groups: Ints | None = None,
    of_vertices: Ints | None = None, finer: Ints | None = None,
) -> CellWriter | IdWriter:  # fmt: skip
    """Return the writer for an ending, or raise an error if the format cannot store the cells."""
    if ending in FORMATS.cell_outputs:
        return CellWriter(cells, labels, None, attributes, form, None, groups).checked([ending])
    own = IdWriter(cells, labels, form, attributes, of_vertices, groups=groups, finer=finer)
    return own.checked([ending])
