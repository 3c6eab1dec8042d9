"""The commands ``superfacets studio`` and ``agree``."""

from __future__ import annotations

import contextlib
import json
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from superfacets.kit import import_extra

from .failures import for_each, print_note, print_notes
from .options import COUNT, FILE, FLAG, FOLDER, POSITIVE, json_option, option, options, up_option

if TYPE_CHECKING:
    from superfacets_studio import Files


@click.command("studio")
@click.argument("path", metavar="IN|FOLDER", type=click.Path(path_type=Path, exists=True))
@options(
    option("-n --n-segments", COUNT, "Number of regions for new work.  [default: 150]"),
    option("-r --radius", POSITIVE, "Radius of a region for new work, instead of -n."),
    option("--scans", FLAG, "For new work on fused scans of rooms, as in `superfacets segment`."),
    option("--features", ("color",), "Data that borders of new work follow, too."),
    option("--work FILE", FILE,
           "File in which the work is saved.  [default: IN.studio.jsonl, beside IN]"),
    option("--classes FILE", FILE,
           "Classes for new work: a .txt file with one class name per line, a .csv file with the"
           " columns id, name, color and stuff, a .json list of classes, or an .objects.json file"
           " exported by the studio. All files of a folder share them."),
    option("--port", click.IntRange(1, 65_535),
           "Port that the server listens on.  [default: a free one, first 28400]"),
    option("--list is_list", FLAG,
           "Print the labeled percentage, active time and strokes of each file, and exit."),
    option("--export exports KIND", None,
           "Write the saved labels of all files that have a work file, and exit: classes,"
           " vertex-classes, instances, objects, region-classes or superfacets, optionally with a"
           " format, such as objects.npz. This option may be given several times.", multiple=True),
    option("-o --output FOLDER", FOLDER, "Folder of exports.  [default: folder of each work file]"),
    up_option,
    option("--no-browser", FLAG, "Print the address without opening a browser."),
)  # fmt: skip
def studio_command(
    path: Path, n_segments: int | None, radius: float | None, scans: bool, features: str | None,
    work: Path | None, classes: Path | None, port: int | None, is_list: bool,
    exports: tuple[str, ...], output: Path | None, up: Any, no_browser: bool,
) -> None:  # fmt: skip
    """Label a mesh, a cloud or all files of a folder in a browser.

    Only browsers on this machine can open the page. Every change is saved immediately.
    """
    _check_extra()
    from superfacets_studio import Files, effort_text, new_classes, rounded

    if is_list and exports:
        raise click.UsageError("--list and --export exclude each other: run the command twice")
    if output is not None and not exports:
        raise click.UsageError("-o is the folder of exports: say what to export with --export")
    files = Files.of(path, work, n_segments, new_classes(classes, path))
    files.parameters = {"radius": radius, "scans": scans, "color": bool(features)}
    files.up = up
    if exports:
        _export(files, exports, output)
    elif is_list:
        for one in files.listed():
            is_changed, done = one.get("changed_since_review"), 100 * rounded(one["done"])
            state = "  changed since review" if is_changed else "  reviewed" * ("reviewed" in one)
            click.echo(f"{done:5.1f} %  {one['name']}{state}{effort_text(one)}")
    else:
        _serve(files, port, is_shown=not no_browser)


def _serve(files: Files, port: int | None, *, is_shown: bool) -> None:
    """Run the server until the user stops it, and open the page if `is_shown`."""
    from superfacets_studio import address_file, open_again, redirection, serve, stored_address

    opened, address = open_again(port, stored_address(address_file(files.home)))
    with opened, contextlib.ExitStack() as stack:

        def show(page: str) -> None:
            click.echo(f"superfacets studio: {page} (press Ctrl-C to stop)")
            if is_shown:
                with contextlib.suppress(OSError):  # the user can still open the printed address
                    webbrowser.open(stack.enter_context(redirection(page)))

        if files.folder is None:
            with files.document(0) as document:
                print_notes(document.notes)
                own = {one["id"]: one["name"] for one in document.class_list}
                if any(own.get(one["id"]) != one["name"] for one in files.classes):
                    print_note("the work has other classes than --classes, which is for new work")
        serve(files, opened, address, show)


def _export(files: Files, exports: tuple[str, ...], output: Path | None) -> None:
    """Write exports of all files that have a work file."""
    from superfacets_studio import parsed_export, write_exports

    wanted, targets = [parsed_export(name) for name in exports], files.targets(output)

    def write(index: int) -> None:
        paths, notes = write_exports(files, index, wanted, targets)
        print_notes(notes)
        for path in paths:
            click.echo(f"wrote {path}")

    if bare := {*range(len(files.paths))} - {*dict(targets)}:
        names = ", ".join(files.name_of(number) for number in sorted(bare))
        print_note(f"exports {len(targets)} of {len(files.paths)} files: no work file of {names}")
    for_each([str(files.path(number)) for number, _ in targets], write)


@click.command("agree")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("mine", metavar="MINE", type=FILE)
@click.argument("theirs", metavar="THEIRS", type=FILE)
@options(
    option("-o --output OUT", FILE, "New file for the merged work, or folder for new files."),
    option("--prefer", ("mine", "theirs"),
           "Whose labels to keep where the two differ.", default="mine"), json_option(),
)  # fmt: skip
def agree_command(
    mesh: Path, mine: Path, theirs: Path, output: Path | None, prefer: str, as_json: bool
) -> None:
    """Compare two people's work in the studio, and merge it.

    MINE and THEIRS are work files of the mesh or point cloud IN. The command prints the percentage
    of the area that both have labeled and, of this area only, the percentage on which class and
    object agree, and the IoU of each class and object ("-": no cell is labeled by both). Classes
    are matched by name, and objects by their overlap. The merged work keeps labels of cells that
    only one person has labeled, and objects that only THEIRS has get new numbers.

    MINE and THEIRS may also be two folders with work files NAME.studio.jsonl, and IN a folder of
    meshes. A table then has mean IoUs of each mesh and of all. Work of only one person is copied.
    """
    _check_extra()
    from superfacets_studio import agreed

    found, text, notes = agreed(mesh, mine, theirs, output, prefer_theirs=prefer == "theirs")
    print_notes(notes)
    click.echo(json.dumps(found, indent=1) if as_json else text)
    if output is not None:
        click.echo(f"wrote {output}", err=as_json)


def _check_extra() -> None:
    for module in ("scipy", "starlette", "uvicorn"):
        import_extra(module, "the studio", "studio")
