"""Segment one file, write the results to files, and estimate the memory that this needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ..base.errors import MeshError
from ..base.timing import timed
from ..base.types import Array
from ..clustering.result import Segmentation
from ..files.attributes import MeshAttributes
from ..files.guards import Content, known_ending, read_content
from ..files.readers.labels import parse_labels
from ..files.readers.read import cell_ending, parse_cells_and_attributes
from ..files.writers.cells import ATTRIBUTE_OUTPUTS
from ..files.writers.write import OUTPUT_ENDINGS, check_fit, check_outputs, write_outputs
from ..graph.constraints import mask_of
from ..mesh.base import Cells
from .segment_file import FileOptions, segment_file

BASE = 150 << 20
"""Memory of a worker process after its imports, in bytes."""

PER_CELL = 200
"""Memory in bytes per cell for graph, weights, labels and temporary arrays, without the mesh. With
1.4 million faces in PLY, OFF and STL, workers used a third to a half of the estimate."""

PER_BYTE = 3
"""Memory in bytes per byte of the input file, for its content, the mesh, and the output."""

FILE_BYTES = {".stl": 50, ".ply": 18, ".obj": 30, ".off": 30, ".tri": 30, ".laz": 3, ".vtp": 6}
"""Minimum number of bytes per cell in a file, for each ending."""

USUAL_FILE_BYTES = 12
"""Minimum number of bytes per cell in a file, for endings that are not in `FILE_BYTES`."""


def cells_of(path: str) -> int:
    """Return an upper bound of the number of cells in a file, from its size; 0 if it is missing."""
    return _size_of(path) // FILE_BYTES.get(Path(path).suffix.lower(), USUAL_FILE_BYTES)


def memory_of(path: str) -> int:
    """Estimate the memory, in bytes, that a process needs to segment a file; usually too high."""
    return BASE + PER_BYTE * _size_of(path) + PER_CELL * cells_of(path)


def _size_of(path: str) -> int:
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0


def segment_to_files(
    source: str,
    files: Sequence[Path],
    options: FileOptions,
    *,
    on_content: Callable[[Content | None], None],
) -> tuple[Segmentation, dict[str, float]]:
    """Segment one file, write the results to `files`, and return the result and the times.

    Missing folders are created. `on_content` is called with the content of the file, or with None
    if it cannot be read.
    """
    for folder in {path.parent for path in files}:
        folder.mkdir(parents=True, exist_ok=True)
    check_outputs(files, force=options.force)
    path = Path(source)
    endings = [known_ending(file, OUTPUT_ENDINGS) for file in files]
    form = options.form(endings)

    def load(keep: bool) -> tuple[Cells, MeshAttributes | None, dict[str, Array]]:
        try:
            content = read_content(path)
        except MeshError:  # for example, an empty file
            on_content(None)
            raise
        on_content(content)
        ending = cell_ending(path)
        cells, attributes = parse_cells_and_attributes(content, ending, path.parent, keep=keep)
        check_fit(cells, None, endings, form)
        constraints: dict[str, Array] = {}
        if options.mask_values:
            labels = parse_labels(content, ending, cells.n_cells, options.labels_named)
            constraints["mask"] = mask_of(labels, options.mask_values, path, cells)
        return cells, attributes, constraints

    timings: dict[str, float] = {}
    holds_attributes = not {*endings}.isdisjoint(ATTRIBUTE_OUTPUTS)
    outcome = segment_file(load, options, holds_attributes=holds_attributes, timings=timings)
    with timed(timings, "export"):
        write_outputs(
            files, outcome.mesh, outcome.result.labels, attributes=outcome.attributes,
            options=form, listed=outcome.listed, listed_mesh=outcome.listed_mesh,
        )  # fmt: skip
    return outcome.result, {**outcome.result.timings, **timings}
