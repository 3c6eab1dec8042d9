"""The commands ``superfacets render`` and ``view``."""

from __future__ import annotations

import re
import tempfile
import webbrowser
from pathlib import Path
from typing import Any, get_args

import click

from superfacets import MeshError, MissingExtraError, Page, View
from superfacets.kit import FORMATS, Array, CellData, CellFile, Cells, kind_of, stored_colors
from superfacets_show import VIEW_NAMES, Clip, Up, checked_page_path

from . import options as opts
from .failures import print_note
from .inputs import labels_for, read_input, stored_labels, up_axis
from .options import FILE, FLAG, option, options
from .progress import Progress
from .report import note_on_up

_OWN_COLORS = "color"  # value of --color-by for the colors in the file


def _size(ctx: click.Context, param: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """Parse a text such as 1200x900 into width and height in pixels (a callback of click)."""
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text or "0x0", re.ASCII)
    if match is None:
        raise click.BadParameter(f"{text!r} is not a size such as 1200x900", ctx, param)
    return None if text is None else (int(match[1]), int(match[2]))


def _values_named(color_by: str | None, data: CellData) -> Array | str | None:
    """Return the values in the file `color_by`, or of the property with this name.

    If `color_by` is a column of the table of regions, it stays; the colors in the file are None.
    """
    if color_by is None or color_by == _OWN_COLORS:
        return None
    if color_by.lower().endswith(FORMATS.value_files):
        return CellFile.values_in(color_by)
    values = data.values(color_by)
    return color_by if values is None else values


@click.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@opts.labels_argument
@options(
    option("-o --output outputs OUT", FILE,
           "Write a picture to this .png file, or an animation of the rotating mesh to this .gif or"
           " .mp4 file. This option may be given several times.", multiple=True, required=True),
    opts.drawing_options, opts.labels_named_option,
    option("--compare L", FILE,
           "Label file for another picture beside the first. This option may be repeated.",
           multiple=True),
    option("--color-by WHAT", None,
           "What the colors show: color (the colors in IN, or else its colors of labels); a .npy or"
           " .txt file with one value per cell, per region, or per vertex of a mesh; a property of"
           " IN, such as intensity; or a column of the table that superfacets regions prints, such"
           " as area.  [default: regions; without labels, color]"),
    opts.viewpoint_option,
    option("--view side", VIEW_NAMES, "Side to look from, instead of --azimuth and --elevation."),
    option("--size WxH", None,
           "Size of each picture in pixels.  [default: 1200x900; 640x480 for animations]",
           callback=_size),
    option("--clip", get_args(Clip),
           "Cut a mesh of tetrahedra open: x keeps the half with larger x, -x the half with smaller"
           " x.  [default: draw the outer surface]"),
    option("--numbers", FLAG, "Write the number (label) of each visible region on the region."),
    option("--see-inside", FLAG,
           "Hide surfaces seen from behind, such as the walls in front of a room that was scanned"
           " from inside; points need normals or --viewpoint."),
)  # fmt: skip
def render_command(
    mesh: Path, outputs: tuple[Path, ...], labels: Path | None, compare: tuple[Path, ...],
    color_by: str | None, viewpoint: tuple[float, ...] | None, up: Up, labels_named: str,
    side: str | None, azimuth: float, elevation: float, numbers: bool, **style: Any,
) -> None:  # fmt: skip
    """Draw a picture of a mesh or point cloud with its regions.

    LABELS is a file with one label per face, point or vertex; without it, the labels in IN are
    drawn. Borders between regions of a mesh are drawn as dark lines. Adjacent regions have colors
    that color-blind people can distinguish.
    """
    from superfacets import plot

    source = read_input(str(mesh))
    up = up_axis(source, up)
    view = View(azimuth=azimuth, elevation=elevation, up=up)
    view = view if side is None else View.named(side, up=up)
    cells, attributes = source.cells_and_attributes()
    cells = kind_of(cells).seen_from(cells, viewpoint)
    if style["see_inside"] and not kind_of(cells).has_fronts(cells):
        raise click.UsageError(f"--see-inside needs normals, and {mesh} has none: give --viewpoint")
    data = CellData(cells, attributes)
    values = _values_named(color_by, data)
    by_region = f"--color-by {values}" if isinstance(values, str) else None
    series, paths = _series_of(source, labels, compare, cells, labels_named, color_by is None)
    needed_by = "--numbers" if numbers else by_region
    if series[0] is None and needed_by is not None:
        raise click.UsageError(f"{needed_by} needs labels, and {source.name} has none: give LABELS")
    colors = None
    if color_by == _OWN_COLORS or (color_by is None and series[0] is None):
        colors = data.colors()
    if color_by == _OWN_COLORS and colors is None:
        colors = None if attributes is None else attributes.region_colors
        if colors is None:
            raise MeshError(f"{mesh} has no colors of faces, vertices or points")
    stems = [FORMATS.stem_of(path) for path in paths]
    titles = stems if len({*stems}) == len({*paths}) else [*map(str, paths)]
    named = None if values is None or isinstance(values, str) else Path(str(color_by))
    for path in outputs:
        try:
            with Progress():
                plotted = plot(
                    cells, series[0], output=path, compare=series[1:], colors=colors,
                    titles=titles if compare else None, color_by=values, view=view, numbers=numbers,
                    scale_title=None if named is None else FORMATS.stem_of(named), **style,
                )  # fmt: skip
        except (ValueError, TypeError) as error:
            if named is None or isinstance(error, MeshError):
                raise
            raise MeshError(f"{named}: {error}") from None
        click.echo(f"wrote {path}{note_on_up(up, plotted.up)}")


def _series_of(
    source: CellFile, labels: Path | None, compare: tuple[Path, ...], cells: Cells, name: str,
    is_noted: bool,
) -> tuple[list[Any], list[Path]]:  # fmt: skip
    """Return the labels of each picture, and their paths; the first labels may be None."""
    paths = [*([] if labels is None else [labels]), *compare]
    series: list[Any] = [labels_for(source, cells, path, name) for path in paths]
    loss = ", so no regions are drawn" if is_noted and not series else None
    shown = stored_labels(source, cells, name, loss) if labels is None else None
    if shown is not None:
        return [shown, *series], [Path(source.name), *paths]
    return series or [None], paths


@click.command("view")
@click.argument("mesh", metavar="IN", type=FILE)
@opts.labels_argument
@options(
    option("--html output OUT", FILE,
           "Write the page to this .html file.  [default: open it in the browser]"),
    opts.labels_named_option, option("--gt SEG", FILE, "Label file with the ground truth."),
    option("--feature features FILE", FILE,
           "A .npy or .txt file with one value per cell, per region of the first level, or per"
           " vertex of a mesh. This option may be given several times.", multiple=True),
    option("--title TEXT", None, "Title of the page.  [default: the name of IN]"),
    opts.drawing_options,
)  # fmt: skip
def view_command(
    mesh: Path, output: Path | None, labels: Path | None, labels_named: str, gt: Path | None,
    features: tuple[Path, ...], title: str | None, up: Up, azimuth: float, elevation: float,
    **style: Any,
) -> None:  # fmt: skip
    """Show a mesh or point cloud with its regions in a browser.

    LABELS is a label file, or an .npz from superfacets levels; without it, the labels in IN are
    shown. The page is a single file, which any browser can open offline. If IN has a texture or
    colors, the page shows them, too. Without --html, the page is a temporary file, and the browser
    opens it.
    """
    from superfacets import view

    try:
        target = None if output is None else checked_page_path(output)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if len({FORMATS.stem_of(path) for path in features}) < len(features):
        raise click.UsageError("two features have the same name: rename their files")
    values = {FORMATS.stem_of(path): CellFile.values_in(path) for path in features}
    source = read_input(str(mesh))
    cells, attributes = source.cells_and_attributes()
    if labels is None:
        shown: Array | None = stored_labels(source, cells, labels_named)
    elif labels.suffix.lower() == ".npz":
        shown = CellFile.levels_in(labels)  # of all L levels, (L, N)
    else:
        shown = labels_for(source, cells, labels, labels_named)
    up = up_axis(source, up)

    def page(texture: Any) -> Page:
        return view(
            cells, shown, features=values, colors=stored_colors(cells, attributes),
            ground_truth=None if gt is None else labels_for(source, cells, gt, labels_named),
            title=mesh.name if title is None else title, texture=texture, **style,
            camera=View(azimuth=azimuth, elevation=elevation, up=up),
        )  # fmt: skip

    try:
        try:
            found = page(None if attributes is None else attributes.texture)
        except (MeshError, MissingExtraError) as error:
            if attributes is None or attributes.texture is None:
                raise
            found = page(None)
            print_note(f"the texture is not shown: {error}")
    except (ValueError, TypeError) as error:  # an input file has wrong values
        raise MeshError(f"{mesh}: {error}") from None
    path = found.save(target or Path(tempfile.mkdtemp(prefix="superfacets-"), f"{mesh.stem}.html"))
    click.echo(f"wrote {output or path}{note_on_up(up, found.up)}")
    if target is None and not webbrowser.open(path.as_uri()):  # the file is kept for the browser
        print_note("no browser was found: open the file yourself, or name a file with --html")
