"""The command ``superfacets studio``."""

from __future__ import annotations

import contextlib
import signal
import sys
import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import click

from ..errors import MissingExtraError
from .failures import print_note
from .options import COUNT, FILE


@click.command("studio")
@click.argument("path", metavar="IN|FOLDER", type=click.Path(path_type=Path, exists=True))
@click.option(
    "-n", "--n-segments", type=COUNT, help="Regions that new work begins with.  [default: 150]"
)
@click.option(
    "--work",
    metavar="FILE",
    type=FILE,
    help="Where the work is kept.  [default: IN.studio.jsonl, beside IN]",
)
@click.option(
    "--classes",
    metavar="FILE",
    type=FILE,
    help="Classes of new work: a .json that the studio has written, or a .txt with a name a line.",
)
@click.option(
    "--port",
    type=click.IntRange(1, 65_535),
    help="Port of this machine to answer at.  [default: one that is free]",
)
@click.option("--list", "is_list", is_flag=True, help="Print how far each file is, and end.")
@click.option("--no-browser", is_flag=True, help="Print the address, and open no browser.")
def studio_command(
    path: Path, n_segments: int | None, work: Path | None, classes: Path | None,
    port: int | None, is_list: bool, no_browser: bool,
) -> None:  # fmt: skip
    """Label a mesh or point cloud, or those of a folder, in a browser.

    The page is served to this machine alone. All work is saved as it is done.
    """
    if not all(find_spec(name) for name in ("scipy", "starlette", "uvicorn")):
        raise MissingExtraError("the studio", "studio")
    from ..studio.address import address_file, kept_address, open_again, redirection
    from ..studio.classes import read_classes
    from ..studio.folder import Files
    from ..studio.server import serve

    given = () if classes is None else read_classes(classes)
    files = Files.of(path, work, n_segments, given)
    if is_list:
        for entry in files.listed():
            reviewed = "  reviewed" if entry.get("reviewed") else ""
            click.echo(f"{100 * entry['done']:5.1f} %  {entry['name']}{reviewed}")
        return
    opened, address = open_again(port, kept_address(address_file(files.home)))
    with opened, contextlib.ExitStack() as stack:
        for name in {"SIGTERM", "SIGHUP"} & set(dir(signal)):  # so that the token file is removed
            number = getattr(signal, name)
            stack.callback(signal.signal, number, signal.signal(number, _end))

        def show(page: str) -> None:
            click.echo(f"superfacets studio: {page} (Ctrl-C ends it)")
            sys.stdout.flush()
            if not no_browser:
                with contextlib.suppress(OSError):  # no temporary file: the address is printed
                    webbrowser.open(stack.enter_context(redirection(page)))

        if files.folder is None:
            with files.document(0) as document:
                for note in document.notes:
                    print_note(note)
        serve(files, opened, address, show)


def _end(number: int, _: object) -> NoReturn:
    sys.exit(128 + number)
