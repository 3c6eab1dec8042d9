"""Options of ``superfacets segment --tiled``, for meshes and point clouds larger than memory."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import click

from ..batches.files import FileOptions
from ..clustering.result import Segmentation
from ..errors import IslandWarning, MeshError, SliverWarning
from ..export.label_files import label_names
from ..io.readers.pieces import holds_files
from .options import COUNT, FLAG, FOLDER, STANDARD_STREAM, Count, option, options
from .outputs import names_of_results
from .progress import TileBar

tile_options = options(
    option("--tiled is_tiled", FLAG,
           "Process the input in tiles, for meshes and point clouds larger than memory. IN is a"
           " file, a folder of files or a tileset.json; meshes of several files are joined where"
           " vertices have the same position. All labels are written to one .npy file. If IN and -o"
           " are folders, each file of IN gets a separate .npy file."),
    option("--tile-size", COUNT,
           "Number of faces or points per tile, with --tiled. Larger tiles need more memory per"
           " worker.  [default: 262144]"),
    option("--scratch", FOLDER,
           "Folder for temporary arrays, with --tiled. They take about 250 bytes per face, or 400"
           " per point.  [default: beside the output]"),
    option("--cache MB", Count(0),
           "Megabytes of temporary arrays kept in memory, with --tiled and a single process."
           "  [default: an eighth of the memory]"),
    option("--workers", COUNT,
           "Number of processes that work on tiles, with --tiled.  [default: 1]"),
    option("--scheduler ADDRESS", None,
           "Address of a Dask scheduler whose workers process the tiles, such as"
           " tcp://10.0.0.1:8786."),
)  # fmt: skip
"""Decorator that adds the options for processing in tiles to a command."""

_NOT_OF_TILES = {
    "--paper": "radius_factor",
    "--connect": "enforce_connectivity",
    "--min-size": "min_size",
    "--feature-weight": "feature_weight",
    "--balance": "balance",
    "--max-measure": "max_measure",
    "--min-measure": "min_measure",
    "--cells-per-region": "cells_per_region",
}
"""Options that `segment_tiled` does not support, and the keywords of `segment` that they set."""

MASK_ADVICE = (
    ": first write the cells to keep to their own file; superfacets convert IN LABELS --split DIR"
    " writes one file per label"
)
"""End of the message that refuses a mask."""


@dataclass(frozen=True)
class TileOptions:
    """Options for a run in tiles; None means the default."""

    tile_size: int | None
    scratch: Path | None
    cache: int | None
    workers: int | None
    scheduler: str | None

    @property
    def keywords(self) -> dict[str, Any]:
        """Options that are keywords of `segment_tiled`."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    @classmethod
    def taken_from(cls, given: dict[str, Any]) -> TileOptions | None:
        """Remove and return the tile options in `given`; return None if ``--tiled`` is not given.

        Raises a usage error if tile options contradict each other, or are given without
        ``--tiled``.
        """
        is_tiled = given.pop("is_tiled")
        found = {field.name: given.pop(field.name) for field in fields(cls)}
        if not is_tiled:
            for name, value in found.items():
                if value is not None:
                    raise click.UsageError(f"--{name.replace('_', '-')} needs --tiled")
            return None
        if found["workers"] is not None and found["scheduler"] is not None:
            raise click.UsageError("give --workers or --scheduler, not both")
        if found["cache"] and (found["workers"] or found["scheduler"]):
            raise click.UsageError("--cache cannot be used with --workers or --scheduler")
        if found["cache"] is not None:
            found["cache"] *= 1_000_000
        return cls(**found)

    def checked_formats(
        self, inputs: Sequence[str], outputs: Sequence[str], formats: Sequence[str],
        given: FileOptions, others: Mapping[str, object],
    ) -> tuple[str, ...]:  # fmt: skip
        """Return the formats for outputs in a folder: ("npy",), or () if ``-o`` names a file.

        Raises a usage error for options and outputs that ``--tiled`` does not support. `others`
        maps the names of further unsupported options to their values.
        """
        if STANDARD_STREAM in (*inputs, *outputs):
            raise click.UsageError("--tiled does not support standard input and output (-)")
        refused = {
            "--features": given.features,
            "--subdivide": given.subdivide,
            "--min-opacity": given.min_opacity,
            "--vertex-labels": given.vertex_labels,
            "--ascii": given.ascii,
            **{name: given.keywords.get(key) for name, key in _NOT_OF_TILES.items()},
            "--init": given.keywords.get("init") not in (None, "geodesic"),
            **others,
        }
        for name, value in refused.items():
            if value:
                advice = MASK_ADVICE if name.startswith("--mask") else ""
                raise click.UsageError(f"--tiled does not support {name}{advice}")
        named = [text for text in outputs if Path(text).suffix and not Path(text).is_dir()]
        wrong = [text for text in named if not text.endswith(".npy")]
        if wrong or set(formats) - {"npy"} or len(outputs) > 1:
            raise click.UsageError(
                "with --tiled, give one output: a .npy file or a folder for labels; afterwards,"
                " superfacets convert can write a mesh with these labels"
            )
        return () if named else ("npy",)


def names_by_tiles(text: str, endings: Sequence[str]) -> Sequence[str]:
    """Return a file name for each ending, or for each file of an input folder or tileset."""
    if holds_files(Path(text)):
        with contextlib.suppress(OSError):  # reading the input will report the error
            return label_names(Path(text))
    return names_of_results(text, endings)


def segment_by_tiles(
    path: Path, files: Sequence[Path], given: FileOptions, tiles: TileOptions, bar: TileBar
) -> Segmentation:
    """Segment a file or a folder of files, and write the labels to a file or a folder."""
    from ..tiles.segmenting import segment_tiled

    folder = files[0].parent
    out = str(files[0]) if len(files) == 1 else f"{folder}/"
    chosen = {"scratch": folder.absolute(), **tiles.keywords}
    used = given.keywords.keys() - _NOT_OF_TILES.values()
    try:
        with warnings.catch_warnings():  # notes on the result replace these warnings
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            return segment_tiled(
                path, out=out, progress=bar.on_iteration, on_stage=bar.on_stage,
                on_tile=bar.on_tile, viewpoint=given.viewpoint, **chosen,
                **{name: given.keywords[name] for name in used},
            )  # fmt: skip
    except MeshError as error:
        message = str(error)
        raise MeshError(message if str(path) in message else f"{path}: {message}") from None
