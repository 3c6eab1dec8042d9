"""The commands ``superfacets info`` and ``formats``."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection, Mapping
from typing import Any

import click
import numpy as np

from superfacets import SliverWarning, cloud_info, mesh_info
from superfacets.kit import FORMATS, CloudInfo, MeshInfo, kind_of

from .failures import for_each, print_notes
from .inputs import name_of, read_input
from .interrupts import run_in_background
from .options import INPUT, USUAL_COUNT, format_option, json_option

_FACES_DOWN = (
    "if z is up, this open surface faces down: aspects are wrong by 180 degrees, and convex and"
    " concave edges are swapped; reverse the order of the corners of each face, or of the rows of"
    " the grid"
)


@click.command("info")
@click.argument("inputs", metavar="IN...", type=INPUT, nargs=-1, required=True)
@format_option("the inputs", of_stream=True)
@json_option("the results as JSON, one line per IN")
def info_command(inputs: tuple[str, ...], format: str | None, as_json: bool) -> None:
    """Print counts and sizes of meshes and point clouds.

    IN may be - for standard input. If an input fails, the remaining inputs are still read, and the
    exit status is 1.
    """

    def report(index: int) -> None:
        text = inputs[index]
        info, of_las = run_in_background(lambda: _read(text, format))
        if isinstance(info, MeshInfo):
            slivers = SliverWarning.text(info.sliver_share, "try segment --subdivide")
            notes = (slivers, _FACES_DOWN if info.faces_down else None)
            print_notes(f"{name_of(text)}: {note}" for note in notes if note is not None)
        if as_json:
            click.echo(json.dumps({"file": text, **dataclasses.asdict(info), **of_las}))
            return
        rows = [*_rows_of(info), *((name.replace("_", " "), str(of_las[name])) for name in of_las)]
        if len(inputs) > 1:
            rows = [("file", name_of(text)), *rows]
        click.echo("\n".join(f"{name:<20} {value}" for name, value in rows))

    for_each([name_of(text) for text in inputs], report)


def _read(text: str, format: str | None) -> tuple[Any, dict[str, str | int]]:
    """Return the measures of a file, and facts that only LAS files have."""
    source = read_input(text, format)
    cells, attributes = source.cells_and_attributes(keep=source.ending in (".las", ".laz"))
    measure: Any = cloud_info if kind_of(cells).are_points else mesh_info
    frame = None if attributes is None else attributes.las
    return measure(cells), {} if frame is None else _facts_of(frame)


def _facts_of(frame: Any) -> dict[str, str | int]:
    return {
        "LAS_version": f"1.{frame.minor}",
        "point_format": frame.point_format,
        "reference_system": frame.reference_system or "none",
    }


def _coordinate(value: float, diagonal: float) -> str:
    """Format a coordinate, rounded to about a millionth of the diagonal of the bounding box."""
    if not 1e-4 < diagonal < 1e12:
        return f"{value:g}"
    n_digits = max(0, 6 - math.floor(math.log10(diagonal)))
    return np.format_float_positional(round(value, n_digits) + 0.0, trim="-")


def _rows_of(info: Any) -> list[tuple[str, str]]:
    low, high = (
        " ".join(_coordinate(value, info.diagonal) for value in corner) for corner in info.bounds
    )
    facts = dataclasses.asdict(info)
    rows = [(_name_of(name), str(n)) for name, n in facts.items() if name.startswith("n_")]
    if isinstance(info, CloudInfo):
        rows += [("normals", _normals_of(info)), ("colors", _colors_of(info))]
    if isinstance(info, MeshInfo):
        slivers = f"{info.sliver_share:.0%} of the area, for {USUAL_COUNT} regions"
        rows += [("inside out", "yes" if info.is_inside_out else "no"), ("slivers", slivers)]
    sizes = ("diagonal", "spacing", "area", "volume")
    lengths = [(name, f"{facts[name]:g}") for name in sizes if name in facts]
    return [*rows, ("bounding box", f"{low} to {high}"), *lengths]


_NAMES = {
    "n_positions": "distinct positions",
    "n_isolated": "isolated points",
    "n_nonmanifold_edges": "non-manifold edges",
    "n_nonmanifold_triangles": "non-manifold",
}
"""Row titles of fields whose title cannot be derived from the field name."""


def _name_of(count: str) -> str:
    """Return the row title of a count, for example "flat tetrahedra" for ``n_flat_tets``."""
    return _NAMES.get(count, count[2:].replace("_", " ").replace("tets", "tetrahedra"))


def _colors_of(info: CloudInfo) -> str:
    """Return a text that says whether a cloud has colors, and whether all colors are equal."""
    if not info.has_colors:
        return "no: all values are 0" if info.are_colors_zero else "no"
    return "yes" if info.colors_differ else "yes, all equal"


def _normals_of(info: CloudInfo) -> str:
    """Return a text that says whether a cloud has normals, or how normals are estimated."""
    if info.has_normals:
        return "yes"
    source = "shortest axes of splats" if info.has_axes else "no: estimated"
    if info.has_viewpoints:
        return f"{source}, toward the viewpoints"
    return f"{source}, outwards" if info.knows_turns else f"{source}, sides guessed"


_LABEL_IMAGE = ".ids.png"  # written from a mesh, but contains only its labels
Tables = Mapping[str, Collection[str]]  # endings by what their files store
_WORDS = dict.fromkeys(("faces", "polygons", "triangles"), "mesh")


@click.command("formats")
def formats_command() -> None:
    """List the formats of files."""
    read: Tables = {**FORMATS.readers, "mesh": FORMATS["scenes"], "labels": FORMATS.labels}
    labels = {*FORMATS.labels, *FORMATS.label_outputs, *FORMATS.id_outputs, *FORMATS.class_outputs}
    kinds = {kind: {*table} - {_LABEL_IMAGE} for kind, table in FORMATS.writers.items()}
    labels = labels & {*FORMATS.outputs} | {_LABEL_IMAGE}
    write: Tables = {**kinds, "labels": labels, "region graph": FORMATS.graph_outputs}
    endings = dict.fromkeys([*FORMATS.cells, *FORMATS.labels, *FORMATS.outputs])
    click.echo(f"{'ending':<18} {'reads':<26} writes")
    for each in endings:
        click.echo(f"{each:<18} {_of(each, read):<26} {_of(each, write)}".rstrip())
    click.echo("For --to and --format, write an ending without its first . or _, such as ply.")


def _of(ending: str, tables: Tables) -> str:
    words = (_WORDS.get(kind, kind) for kind, table in tables.items() if ending in table)
    return ", ".join(dict.fromkeys(words))
