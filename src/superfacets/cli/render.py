"""The command ``superfacets render``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy.typing as npt

from .._options import CLIPS
from ..errors import MeshError
from ..io.readers.labels import read_labels
from ..io.readers.read import read_cells
from .failures import print_note
from .inputs import labels_beside
from .options import FILE, camera_options, labels_named_option
from .picture_options import chosen_view, picture_options, values_named

if TYPE_CHECKING:
    from .._options import Clip
    from ..pictures.camera import Up


@click.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option("-o", "--output", metavar="OUT", type=FILE, help="A .png file.")
@camera_options
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="A .npy, .seg, .txt or labeled .ply or .vtp; those in IN, if it has any, otherwise.",
)
@labels_named_option
@picture_options
@click.option(
    "--clip",
    type=click.Choice(CLIPS),
    help="Of tetrahedra, show what lies on one side of the middle: x keeps that of larger x, -x"
    " that of smaller x.  [default: the outside of all]",
)
def render_command(
    mesh: Path, output: Path | None, up: Up, azimuth: float, elevation: float,
    labels: Path | None, labels_named: str, clip: Clip | None, turntable: Path | None,
    compare: tuple[Path, ...], color_by: str | None, side: str | None,
    size: tuple[int, int] | None,
) -> None:  # fmt: skip
    """Draw a shaded picture of the mesh or point cloud in the file IN, with its regions.

    Borders between regions of a mesh are dark lines. Regions that touch have colors that
    color-blind people tell apart, too.
    """
    from ..pictures.plotting import plot

    if output is None and turntable is None:
        raise click.UsageError("nothing to write: -o names a .png, --turntable a .gif or .mp4")
    if output is not None and output.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: pictures are written as .png")
    view = chosen_view(side, azimuth=azimuth, elevation=elevation, up=up)
    cells = read_cells(mesh)
    shown, others, titles = _series_of(mesh, labels, compare, cells.n_cells, labels_named)
    values = values_named(color_by)
    named = None if values is None or isinstance(values, str) else Path(str(color_by))
    for path in [path for path in (output, turntable) if path is not None]:
        try:
            plot(
                cells, shown, output=path, compare=others, titles=titles, size=size,
                color_by=values, scale_title=None if named is None else named.stem, view=view,
                clip=clip,
            )  # fmt: skip
        except (ValueError, TypeError) as error:
            if named is None or isinstance(error, MeshError):
                raise
            raise MeshError(f"{named}: {error}") from None
        click.echo(f"wrote {path}")


def _series_of(
    mesh: Path, labels: Path | None, compare: tuple[Path, ...], n_cells: int, name: str
) -> tuple[npt.NDArray[Any] | None, list[npt.NDArray[Any]], list[str] | None]:
    """Labels of the first picture, or None if it is plain, of those beside it, and their titles."""
    paths = [*([] if labels is None else [labels]), *compare]
    if paths:
        first, *others = [read_labels(path, n_cells, name=name) for path in paths]
        return first, others, [path.stem for path in paths] if compare else None
    shown = labels_beside(mesh, None, n_cells, name)
    if shown is None:
        print_note(f"{mesh} holds no labels: the picture is plain; --labels names a file of them")
    return shown, [], None
