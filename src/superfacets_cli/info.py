"""The commands ``superfacets info`` and ``formats``."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, SliverWarning, cloud_info, mesh_info
from superfacets.kit import FORMATS, kind_of

from .failures import EXIT_DATA, count_failures, print_note
from .inputs import check_inputs, name_of, read_input
from .interrupts import run_in_background
from .options import INPUT, USUAL_COUNT, format_option, json_option

MAX_BYTES_OF_ATTRIBUTES = 100 << 20
"""Maximum size, in bytes, of files whose attributes are read to report constant properties."""

_FACES_DOWN = (
    "if z is up, this open surface faces down: aspects are wrong by 180 degrees, and convex and"
    " concave edges are swapped; reverse the order of the corners of each face, or of the rows of"
    " the grid"
)


@click.command("info")
@click.argument("inputs", metavar="IN...", type=INPUT, nargs=-1, required=True)
@format_option("the inputs", of_stream=True)
@json_option("the results as JSON, one line per IN")
@click.pass_context
def info_command(
    ctx: click.Context, inputs: tuple[str, ...], format: str | None, as_json: bool
) -> None:
    """Print counts and sizes of meshes and point clouds.

    IN may be - for standard input. If an input fails, the remaining inputs are still read, and the
    exit status is 1.
    """
    check_inputs(inputs)

    def report(index: int) -> None:
        text = inputs[index]
        info, attributes, frame, fates = run_in_background(lambda: _read(text, format))
        of_las = {} if frame is None else frame.facts
        slivers = getattr(info, "sliver_share", 0.0)
        note = SliverWarning.text(slivers, "try segment --subdivide")
        if note is not None:
            print_note(f"{name_of(text)}: {note}")
        if getattr(info, "faces_down", False):
            print_note(f"{name_of(text)}: {_FACES_DOWN}")
        constant = _constant_properties(attributes)
        if constant:
            names = ", ".join(constant)
            print_note(f"{name_of(text)}: properties with the same value everywhere: {names}")
        if as_json:
            click.echo(json.dumps({"file": text, **dataclasses.asdict(info), **of_las, **fates}))
            return
        others = {**{name: "; ".join(items) for name, items in fates.items() if items}, **of_las}
        rows = [*_rows_of(info), *((name.replace("_", " "), str(others[name])) for name in others)]
        if len(inputs) > 1:
            rows = [("file", name_of(text)), *rows]
        click.echo("\n".join(f"{name:<20} {value}" for name, value in rows))

    if count_failures([name_of(text) for text in inputs], report):
        ctx.exit(EXIT_DATA)


def _read(text: str, format: str | None) -> tuple[Any, MeshAttributes | None, Any, Any]:
    path = Path(text)
    keep = not path.is_file() or path.stat().st_size <= MAX_BYTES_OF_ATTRIBUTES
    source = read_input(text, format)
    is_las = source.ending in (".las", ".laz")
    cells, attributes = source.cells_and_attributes(keep=keep or is_las)
    frame = None if attributes is None else attributes.header
    # Constant fields of LAS files are not reported: most files leave some fields unused.
    measure: Any = cloud_info if kind_of(cells).are_points else mesh_info
    fates = {} if attributes is None else attributes.fates
    return measure(cells), attributes if keep and not is_las else None, frame, fates


def _constant_properties(attributes: MeshAttributes | None) -> list[str]:
    """Return the names of properties, except colors, that have the same value everywhere."""
    if attributes is None:
        return []
    stored = {**attributes.vertex, **attributes.face}
    return [
        name
        for name, values in stored.items()
        if name not in ("red", "green", "blue", "alpha")
        and len(values)
        and (values == values[0]).all()
    ]


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
    if "spacing" in facts:
        rows += [("normals", _normals_of(info)), ("colors", _colors_of(info))]
    if "sliver_share" in facts:
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


def _colors_of(info: Any) -> str:
    """Return a text that says whether a cloud has colors, and whether all colors are equal."""
    if not info.has_colors:
        return "no: all values are 0" if info.are_colors_zero else "no"
    return "yes" if info.colors_differ else "yes, all equal"


def _normals_of(info: Any) -> str:
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
    cells = {"mesh": FORMATS["read"], "points": FORMATS["read_points"]}
    read: Tables = {**cells, "labels": FORMATS.labels}
    labels = {*FORMATS.labels, *FORMATS.label_outputs, *FORMATS.id_outputs, *FORMATS.class_outputs}
    kinds = {kind: {*table} - {_LABEL_IMAGE} for kind, table in FORMATS.writers.items()}
    labels = labels & {*FORMATS.outputs} | {_LABEL_IMAGE}
    write: Tables = {**kinds, "labels": labels, "region graph": FORMATS.graph_outputs}
    endings = dict.fromkeys([*FORMATS.cells, *FORMATS.labels, *FORMATS.outputs])
    click.echo(f"{'ending':<18} {'reads':<26} {'with extra':<11} writes")
    for each in endings:
        extra = FORMATS.extras.get(each, "")
        click.echo(f"{each:<18} {_of(each, read):<26} {extra:<11} {_of(each, write)}".rstrip())
    click.echo("For --to and --format, write an ending without its first . or _, such as ply.")


def _of(ending: str, tables: Tables) -> str:
    words = (_WORDS.get(kind, kind) for kind, table in tables.items() if ending in table)
    return ", ".join(dict.fromkeys(words))
