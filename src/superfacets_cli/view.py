"""The command ``superfacets view``."""

from __future__ import annotations

import webbrowser
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING

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
    names = [path.stem for path in features]
    if len(set(names)) < len(names):
        raise click.UsageError("two features have the same name: rename their files")
    source = read_input(str(mesh))
    cells, attributes = source.cells_and_attributes()
    texture = None if attributes is None else attributes.texture
    colors = stored_colors(cells, attributes)
    shown = _levels_of(source, labels, cells, labels_named)
    if shown is None:
        print_note(f"{mesh} has no labels: give a label file as LABELS")
    truth = None if gt is None else labels_for(source, cells, gt, labels_named, is_noted=False)
    values = {path.stem: read_values(path) for path in features}
    up = up_axis(source, up)
    camera = View(azimuth=azimuth, elevation=elevation, up=up)
    name = mesh.name if title is None else title
    page = None
    show = partial(
        view, cells, shown, ground_truth=truth, features=values, colors=colors, title=name,
        camera=camera,
    )  # fmt: skip
    if texture is not None:
        try:
            page = show(texture=texture)
        except (MeshError, MissingExtraError) as error:
            print_note(f"the texture is not shown: {error}")
    try:
        page = page or show()
    except (ValueError, TypeError) as error:  # an input file has wrong values
        raise MeshError(f"{mesh}: {error}") from None
    if target is not None:
        page.save(target)
        click.echo(f"wrote {output}{note_on_up(up, page.up)}")
    else:
        _open(page, mesh.stem, note_on_up(up, page.up))


def _open(page: Page, name: str, note: str) -> None:
    """Open the page in the browser. The file is kept, because the browser may read it later."""
    path = page.save(Path(mkdtemp(prefix="superfacets-"), f"{name}.html"))
    click.echo(f"wrote {path}{note}")
    if not webbrowser.open(path.as_uri()):
        print_note("no browser was found: open the file yourself, or name a file with --html")


def _levels_of(source: CellFile, path: Path | None, cells: Cells, name: str) -> Array | None:
    """Return labels of one level, shape (N,), or of all L levels in an .npz, shape (L, N)."""
    if path is None or path.suffix.lower() != ".npz":
        return labels_beside(source, path, cells, name, is_noted=False)
    return CellFile.levels_in(path)
