"""The command ``superfacets render``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy.typing as npt

from .._options import CLIPS
from ..io.readers.labels import has_labels, read_labels
from ..io.readers.read import read_cells
from ..mesh.faces import n_cells_of
from .failures import print_note
from .options import FILE, Real

if TYPE_CHECKING:
    from .._options import Clip
    from ..pictures.camera import Up

__all__ = ["render_command"]


@click.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option("-o", "--output", metavar="OUT", type=FILE, required=True, help="A .png file.")
@click.option(
    "--up",
    type=click.Choice(("auto", "x", "y", "z")),
    default="auto",
    show_default=True,
    help="Axis that points up; a guess between y and z by default.",
)
@click.option("--azimuth", type=Real(), default=30.0, show_default=True, help="Degrees around.")
@click.option(
    "--elevation",
    type=Real(-90, 90),
    default=15.0,
    show_default=True,
    help="Degrees above the horizon.",
)
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="A .npy, .seg, .txt or labeled .ply or .vtp; those in IN, if it has any, otherwise.",
)
@click.option(
    "--clip",
    type=click.Choice(CLIPS),
    help="Of tetrahedra, show what lies on one side of the middle: x keeps that of larger x, -x"
    " that of smaller x.  [default: the outside of all]",
)
def render_command(
    mesh: Path, output: Path, up: Up, azimuth: float, elevation: float, labels: Path | None,
    clip: Clip | None,
) -> None:  # fmt: skip
    """Draw a shaded picture of the mesh or point cloud in the file IN, with its regions.

    Borders between regions of a mesh are dark lines.
    """
    from ..pictures.rendering import View, render

    if output.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: pictures are written as .png")
    surface = read_cells(mesh)
    n_cells = n_cells_of(surface)
    shown = _labels_of(mesh, n_cells) if labels is None else read_labels(labels, n_cells)
    if shown is None:
        print_note(f"{mesh} holds no labels: the picture is plain; --labels names a file of them")
    view = View(azimuth=azimuth, elevation=elevation, up=up)
    render(surface, shown, output=output, view=view, clip=clip)
    click.echo(f"wrote {output}")


def _labels_of(path: Path, n_cells: int) -> npt.NDArray[Any] | None:
    """The labels that a file holds along with its mesh or cloud; None if it has none."""
    return read_labels(path, n_cells) if has_labels(path) else None
