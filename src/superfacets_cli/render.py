"""The command ``superfacets render``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import click

from superfacets import MeshError, RegionGraph, View
from superfacets.kit import Array, CellData, CellFile, Cells, checked_choice, kind_of
from superfacets_show import VIEW_NAMES, Clip, Up

from . import options as opts
from .failures import print_note
from .inputs import VALUE_ENDINGS, labels_for, read_input, read_values, up_axis
from .options import FILE, FLAG, option, options
from .progress import WaitBar
from .report import note_on_up

_MAX_SIDE = 8192

_OWN_COLORS = "color"  # value of --color-by for the colors in the file


def _checked_size(
    ctx: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[int, int] | None:
    """Parse a text such as 1200x900 into width and height in pixels (a callback of click)."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text, re.ASCII)
    width, height = (int(side) for side in match.groups()) if match else (0, 0)
    if not (1 <= width <= _MAX_SIDE and 1 <= height <= _MAX_SIDE):
        message = f"{text!r} is not a size such as 1200x900, with sides of 1 to {_MAX_SIDE}"
        raise click.BadParameter(message, ctx, parameter)
    return width, height


def _checked_turntable(
    ctx: click.Context, parameter: click.Parameter, path: Path | None
) -> Path | None:
    if path is not None and path.suffix.lower() not in (".gif", ".mp4"):
        raise click.BadParameter(f"{path} must end in .gif or .mp4", ctx, parameter)
    return path


def _chosen_view(side: str | None, *, azimuth: float, elevation: float, up: Up) -> View:
    """Return the view given by name or by angles; raise a usage error if both are given."""
    if side is None:
        return View(azimuth=azimuth, elevation=elevation, up=up)
    source = click.get_current_context().get_parameter_source
    given = click.core.ParameterSource.COMMANDLINE
    if given in (source("azimuth"), source("elevation")):
        raise click.UsageError("give --view, or --azimuth and --elevation, not both")
    return View.named(side, up=up)


def _values_named(color_by: str | None, data: CellData) -> Array | str | None:
    """Return the values in the file `color_by`, or of the property with this name.

    If `color_by` is a column of the table of regions, it is returned unchanged. The result is None
    for the colors in the file.
    """
    if color_by is None or color_by == _OWN_COLORS:
        return None
    if Path(color_by).suffix.lower() in VALUE_ENDINGS:
        return read_values(Path(color_by))
    values = data.values(color_by)
    if values is not None:
        return values
    columns = RegionGraph.column_names(kind_of(data.cells).dimension)
    return checked_choice(color_by, "--color-by", columns)


@click.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@opts.labels_argument
@options(
    option("-o --output OUT", FILE, "Write the picture to this .png file."),
    opts.camera_options,
    opts.labels_named_option,
    option("--turntable OUT", FILE,
           "Write an animation of the rotating mesh to this .gif or .mp4 file.",
           callback=_checked_turntable),
    option("--compare L", FILE,
           "Label file for another picture beside the first; may be given several times.",
           multiple=True),
    option("--color-by WHAT", None,
           "What the colors show: color (the colors in IN, or else its colors of labels); a .npy or"
           " .txt file with one value per cell, per region, or per vertex of a mesh; a property of"
           " IN, such as intensity; or a column of the table that superfacets regions prints, such"
           " as area.  [default: regions; without labels, color]"),
    opts.viewpoint_option,
    option("--view side", VIEW_NAMES,
           "Side from which to look, instead of --azimuth and --elevation."),
    option("--size WxH", None,
           "Size of each picture in pixels.  [default: 1200x900; 640x480 with --turntable]",
           callback=_checked_size),
    option("--clip", get_args(Clip),
           "Cut a mesh of tetrahedra open: x keeps the half with larger x, -x the half with smaller"
           " x.  [default: draw the outer surface]"),
    option("--smooth-borders", FLAG,
           "Draw region borders of a mesh as smooth curves, as computed by superfacets cut."),
    option("--numbers", FLAG, "Write the number (label) of each visible region on the region."),
    option("--see-inside", FLAG,
           "Hide surfaces seen from behind, such as the walls in front of a room that was scanned"
           " from inside; points need normals or --viewpoint."),
)  # fmt: skip
def render_command(
    mesh: Path, output: Path | None, up: Up, azimuth: float, elevation: float,
    labels: Path | None, labels_named: str, clip: Clip | None, turntable: Path | None,
    compare: tuple[Path, ...], color_by: str | None, viewpoint: tuple[float, ...] | None,
    side: str | None, size: tuple[int, int] | None, smooth_borders: bool,
    numbers: bool, see_inside: bool,
) -> None:  # fmt: skip
    """Draw a picture of a mesh or point cloud with its regions.

    LABELS is a file with one label per face, point or vertex; without it, the labels in IN are
    drawn. Borders between regions of a mesh are drawn as dark lines. Adjacent regions have colors
    that color-blind people can distinguish.
    """
    from superfacets import plot

    if output is None and turntable is None:
        raise click.UsageError("nothing to write: give -o a .png, or --turntable a .gif or .mp4")
    if output is not None and output.suffix.lower() != ".png":
        raise click.UsageError(f"{output} must end in .png")
    source = read_input(str(mesh))
    up = up_axis(source, up)
    view = _chosen_view(side, azimuth=azimuth, elevation=elevation, up=up)
    cells, attributes = source.cells_and_attributes()
    if viewpoint is not None:
        cells = kind_of(cells).seen_from(cells, viewpoint)
    if see_inside and not kind_of(cells).has_fronts(cells):
        raise click.UsageError(f"--see-inside needs normals, and {mesh} has none: give --viewpoint")
    values = _values_named(color_by, CellData(cells, attributes))
    by_region = f"--color-by {values}" if isinstance(values, str) else None
    needed_by = "--numbers" if numbers else by_region
    shown, others, titles = _series_of(source, labels, compare, cells, labels_named, needed_by)
    colors = None
    if color_by == _OWN_COLORS or (color_by is None and shown is None):
        colors = CellData(cells, attributes).colors()
    if color_by == _OWN_COLORS and colors is None and attributes is not None:
        colors = attributes.region_colors
    if color_by == _OWN_COLORS and colors is None:
        raise MeshError(f"{mesh} has no colors of faces, vertices or points")
    named = None if values is None or isinstance(values, str) else Path(str(color_by))
    for path in [path for path in (output, turntable) if path is not None]:
        try:
            with WaitBar():
                plotted = plot(
                    cells, shown, output=path, compare=others, titles=titles, size=size,
                    colors=colors, color_by=values, view=view, clip=clip, numbers=numbers,
                    scale_title=None if named is None else named.stem, see_inside=see_inside,
                    smooth_borders=smooth_borders,
                )  # fmt: skip
        except (ValueError, TypeError) as error:
            if named is None or isinstance(error, MeshError):
                raise
            raise MeshError(f"{named}: {error}") from None
        click.echo(f"wrote {path}{note_on_up(up, plotted.up)}")


def _series_of(
    source: CellFile, labels: Path | None, compare: tuple[Path, ...], cells: Cells, name: str,
    needed_by: str | None,
) -> tuple[Array | None, list[Array], list[str] | None]:  # fmt: skip
    """Return the labels of the first picture, the labels of further pictures, and the titles.

    The first labels are None if there are none. The titles are None without ``--compare``. If
    there are no labels and `needed_by`, an option that needs labels, is not None, a usage error is
    raised.
    """
    shown = source.labels(cells.n_cells, name) if labels is None else None
    paths = [*([] if labels is None else [labels]), *compare]
    if paths:
        series = [labels_for(source, cells, path, name, is_noted=False) for path in paths]
        if shown is not None:
            series, paths = [shown, *series], [Path(source.name), *paths]
        return series[0], series[1:], _titles(paths) if compare else None
    if shown is None and needed_by is not None:
        message = f"{needed_by} needs labels, and {source.name} has none: give LABELS"
        raise click.UsageError(message)
    if shown is None:
        note = "has no labels, so no regions are drawn: give a label file as LABELS"
        print_note(f"{source.name} {note}")
    return shown, [], None


def _titles(paths: Sequence[Path]) -> list[str]:
    """Return the stem of each path, with as many of its last folders as make titles differ."""
    for n_parts in range(1, 1 + max(len(path.parts) for path in paths)):
        titles = [Path(*path.with_suffix("").parts[-n_parts:]).as_posix() for path in paths]
        if len({*titles}) == len({*paths}):
            return titles
    return [str(path) for path in paths]
