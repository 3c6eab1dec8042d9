"""Options of pictures: from where, how large, of what, and turning."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..pictures.animation import MOVING_ENDINGS
from ..pictures.camera import VIEW_NAMES, View
from .inputs import VALUE_ENDINGS, read_values
from .options import FILE

if TYPE_CHECKING:
    import numpy.typing as npt

    from ..pictures.camera import Up

_MAX_SIDE = 8192


def _checked_size(
    ctx: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[int, int] | None:
    """Width and height in pixels."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text, re.ASCII)
    width, height = (int(side) for side in match.groups()) if match else (0, 0)
    if not (1 <= width <= _MAX_SIDE and 1 <= height <= _MAX_SIDE):
        message = f"{text!r} is not like 1200x900, of sides 1 to {_MAX_SIDE}"
        raise click.BadParameter(message, ctx, parameter)
    return width, height


def _checked_turntable(
    ctx: click.Context, parameter: click.Parameter, path: Path | None
) -> Path | None:
    if path is not None and path.suffix.lower() not in MOVING_ENDINGS:
        raise click.BadParameter(f"{path}: turns are written as .gif or .mp4", ctx, parameter)
    return path


def picture_options(command: Any) -> Any:
    """Add the options of what a picture shows besides regions; a decorator of commands."""
    options = [
        click.option(
            "--turntable",
            metavar="OUT",
            type=FILE,
            callback=_checked_turntable,
            help="A .gif or .mp4 file of the mesh as it turns.",
        ),
        click.option(
            "--compare",
            metavar="L",
            type=FILE,
            multiple=True,
            help="Labels to draw side by side, after those of --labels; several times.",
        ),
        click.option(
            "--color-by",
            metavar="WHAT",
            help="A .npy or .txt file with a value per cell or per region, or a column of"
            " superfacets regions, such as area.",
        ),
        click.option(
            "--view",
            "side",
            type=click.Choice(VIEW_NAMES),
            help="A side, instead of --azimuth and --elevation.",
        ),
        click.option(
            "--size",
            metavar="WxH",
            callback=_checked_size,
            help="Pixels of each picture.  [default: 1200x900; of a turn 640x480]",
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def chosen_view(side: str | None, *, azimuth: float, elevation: float, up: Up) -> View:
    """The view of that name, or that of the angles; a usage error where both are given."""
    if side is None:
        return View(azimuth=azimuth, elevation=elevation, up=up)
    source = click.get_current_context().get_parameter_source
    given = click.core.ParameterSource.COMMANDLINE
    if given in (source("azimuth"), source("elevation")):
        raise click.UsageError("--view is a pair of --azimuth and --elevation: leave out those")
    return View.named(side, up=up)


def values_named(color_by: str | None) -> npt.NDArray[Any] | str | None:
    """The values in a file of that name; other names are those of columns."""
    if color_by is None or Path(color_by).suffix.lower() not in VALUE_ENDINGS:
        return color_by
    return read_values(Path(color_by))
