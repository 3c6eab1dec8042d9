"""The command ``superfacets render``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .._options import CLIPS
from ..io.readers.read import read_cells
from ..mesh.faces import n_cells_of
from .failures import print_note
from .inputs import labels_beside
from .options import FILE, camera_options, labels_named_option

if TYPE_CHECKING:
    from .._options import Clip
    from ..view.camera import Up

__all__ = ["render_command"]


@click.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option("-o", "--output", metavar="OUT", type=FILE, required=True, help="A .png file.")
@camera_options
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="A .npy, .seg, .txt or labeled .ply or .vtp; those in IN, if it has any, otherwise.",
)
@labels_named_option
@click.option(
    "--clip",
    type=click.Choice(CLIPS),
    help="Of tetrahedra, show what lies on one side of the middle: x keeps that of larger x, -x"
    " that of smaller x.  [default: the outside of all]",
)
def render_command(
    mesh: Path, output: Path, up: Up, azimuth: float, elevation: float, labels: Path | None,
    labels_named: str, clip: Clip | None,
) -> None:  # fmt: skip
    """Draw a shaded picture of the mesh or point cloud in the file IN, with its regions.

    Borders between regions of a mesh are dark lines.
    """
    from ..view.rendering import View, render

    if output.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: pictures are written as .png")
    surface = read_cells(mesh)
    n_cells = n_cells_of(surface)
    shown = labels_beside(mesh, labels, n_cells, labels_named)
    if shown is None:
        print_note(f"{mesh} holds no labels: the picture is plain; --labels names a file of them")
    view = View(azimuth=azimuth, elevation=elevation, up=up)
    render(surface, shown, output=output, view=view, clip=clip)
    click.echo(f"wrote {output}")
