"""The command ``superfacets view``."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

import click

from superfacets import MeshError, MissingExtraError
from superfacets.kit import Array, CellFile, Cells, stored_colors

from .failures import print_note
from .inputs import labels_beside, labels_for, read_input, read_values, up_axis
from .options import FILE, camera_options, labels_argument, labels_named_option, option, options
from .report import note_on_up

if TYPE_CHECKING:
    from superfacets import Page
    from superfacets_show import Up


@click.command("view")
@click.argument("mesh", metavar="IN", type=FILE)
@labels_argument
@options(
    option("--html output OUT", FILE,
           "Write the page to this .html file.  [default: open it in the browser]"),
    labels_named_option,
    option("--gt SEG", FILE, "Label file with the ground truth."),
    option("--feature features FILE", FILE,
           "A .npy or .txt file with one value per cell, per region of the first level, or per"
           " vertex of a mesh; may be given several times.", multiple=True),
    option("--title TEXT", None, "Title of the page.  [default: the name of IN]"),
    camera_options,
)  # fmt: skip
def view_command(
    mesh: Path, output: Path | None, labels: Path | None, labels_named: str, gt: Path | None,
    features: tuple[Path, ...], title: str | None, up: Up, azimuth: float, elevation: float,
) -> None:  # fmt: skip
    """Show a mesh or point cloud with its regions in a browser.

    LABELS is a label file, or an .npz from superfacets levels; without it, the labels in IN are
    shown. The page is a single file, which any browser can open offline. If IN has a texture or
    colors, the page shows them, too. Without --html, the page is a temporary file, and the browser
    opens it.
    """
    from superfacets import View, view
    from superfacets_show import checked_page_path

    try:
        target = None if output is None else checked_page_path(output)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    values = {path.stem: read_values(path) for path in features}
    if len(values) < len(features):
        raise click.UsageError("two features have the same name: rename their files")
    source = read_input(str(mesh))
    cells, attributes = source.cells_and_attributes()
    shown = _levels_of(source, labels, cells, labels_named)
    if shown is None:
        print_note(f"{mesh} has no labels: give a label file as LABELS")
    up = up_axis(source, up)

    def page(texture: Any) -> Page:
        return view(
            cells, shown, features=values, colors=stored_colors(cells, attributes),
            ground_truth=None if gt is None else labels_for(source, cells, gt, labels_named),
            title=mesh.name if title is None else title, texture=texture,
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
    path = found.save(target or Path(mkdtemp(prefix="superfacets-"), f"{mesh.stem}.html"))
    click.echo(f"wrote {output or path}{note_on_up(up, found.up)}")
    if target is None and not webbrowser.open(path.as_uri()):  # the file is kept for the browser
        print_note("no browser was found: open the file yourself, or name a file with --html")


def _levels_of(source: CellFile, path: Path | None, cells: Cells, name: str) -> Array | None:
    """Return labels of one level, shape (N,), or of all L levels in an .npz, shape (L, N)."""
    if path is None or path.suffix.lower() != ".npz":
        return labels_beside(source, path, cells, name)
    return CellFile.levels_in(path)
