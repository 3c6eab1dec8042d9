"""The command ``superfacets formats``."""

from collections.abc import Collection, Mapping

import click

from superfacets.kit import FORMATS

_LABEL_IMAGE = ".ids.png"  # written from a mesh, but contains only its labels


@click.command("formats")
def formats_command() -> None:
    """List the formats of files."""
    read: dict[str, Collection[str]] = {
        **FORMATS.readers,
        "mesh": FORMATS["scenes"],
        "labels": FORMATS.labels,
    }
    labels = {*FORMATS.labels, *FORMATS.label_outputs, *FORMATS.id_outputs, *FORMATS.class_outputs}
    kinds = {kind: {*table} - {_LABEL_IMAGE} for kind, table in FORMATS.writers.items()}
    write: dict[str, Collection[str]] = {
        **kinds,
        "labels": labels & {*FORMATS.outputs} | {_LABEL_IMAGE},
    }
    write["region graph"] = FORMATS.graph_outputs
    endings = dict.fromkeys([*FORMATS.cells, *FORMATS.labels, *FORMATS.outputs])
    rows = [
        ("ending", "reads", "writes"),
        *((each, _of(each, read), _of(each, write)) for each in endings),
    ]
    for ending, reads, writes in rows:
        click.echo(f"{ending:<18} {reads:<26} {writes}".rstrip())
    click.echo("For --to and --format, write an ending without its first . or _, such as ply.")


_WORDS = dict.fromkeys(("faces", "polygons", "triangles"), "mesh")


def _of(ending: str, tables: Mapping[str, Collection[str]]) -> str:
    words = (_WORDS.get(kind, kind) for kind, table in tables.items() if ending in table)
    return ", ".join(dict.fromkeys(words))
