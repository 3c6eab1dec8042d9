"""The command ``superfacets agree``."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from ..errors import MissingExtraError
from .options import FILE


@click.command("agree")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("mine", metavar="MINE", type=FILE)
@click.argument("theirs", metavar="THEIRS", type=FILE)
@click.option(
    "-o", "--output", metavar="FILE", type=FILE, help="Write the merged work to this new file."
)
@click.option(
    "--prefer",
    type=click.Choice(["mine", "theirs"]),
    default="mine",
    show_default=True,
    help="Whose class and object cells get on which both differ.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def agree_command(
    mesh: Path, mine: Path, theirs: Path, output: Path | None, prefer: str, as_json: bool
) -> None:
    """Compare two people's work in the studio, and merge it.

    MINE and THEIRS are work files of the mesh or point cloud in the file IN. Prints the share of
    the area on which both agree, and the IoU of each class and object. Classes are matched by name,
    and objects by the area they share. What only one has labeled is in the merged work, too.
    """
    if not all(find_spec(name) for name in ("scipy", "starlette", "uvicorn")):
        raise MissingExtraError("the studio", "studio")
    from ..studio.document import merged_work

    if output is not None and output.exists():
        raise FileExistsError(f"{output}: is there already")
    found = merged_work(mesh, mine, theirs, output, prefer_theirs=prefer == "theirs")
    click.echo(json.dumps(found, indent=1) if as_json else _text(found))
    if output is not None:
        click.echo(f"wrote {output}", err=as_json)


def _text(found: dict[str, Any]) -> str:
    lines = [f"agreed {100 * found['share']:.1f} % of the area that both have labeled"]
    for row in found["classes"]:
        lines.append(f"{row['iou']:.3f}  {row['name']}")
        lines += [f"  {one['iou']:.3f}  {row['name']} {one['object']}" for one in row["objects"]]
    return "\n".join(lines)
