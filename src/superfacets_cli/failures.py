"""Print error messages and notes on stderr, and define exit statuses."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence

import click

from superfacets import MeshError, RenderError

EXIT_DATA, EXIT_USAGE = 1, 2

QUIET = "superfacets.quiet"  # key in `Context.meta`

FAILURES = (OSError, MeshError, ImportError, RenderError, MemoryError)
"""Errors caused by files or by the machine. Any other ValueError means a wrong parameter."""


def message_of(error: BaseException) -> str:
    """Return the text of an error.

    Errors of the operating system begin with the name of the file or with "standard output".
    """
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'standard output'}: {error.strerror}"
    return str(error)


def for_each(names: Sequence[str], do: Callable[[int], object]) -> None:
    """Call `do` with the index of each input; if some fail, print their errors, and exit.

    With ``--json``, each error is also printed as a JSON object. If there is only one input, a
    ValueError that is not in `FAILURES` is raised again, because it means a wrong parameter on the
    command line. So is a BrokenPipeError, because click then ends the process silently.
    """
    n_failed, is_one_of_many = 0, len(names) > 1
    context = click.get_current_context()
    for index, name in enumerate(names):
        try:
            do(index)
        except BrokenPipeError:
            raise
        except (*FAILURES, ValueError) as error:
            if not (is_one_of_many or isinstance(error, FAILURES)):
                raise
            message = message_of(error)
            if is_one_of_many and name not in message:
                message = f"{name}: {message}"
            print_error(message)
            if context.params.get("as_json"):
                is_stream = "-" in (*context.params.get("outputs", ()), name)
                click.echo(json.dumps({"file": name, "error": message}), err=is_stream)
            n_failed += 1
    if n_failed and is_one_of_many:
        print_error(f"{n_failed} of {len(names)} files failed")
    if n_failed:
        context.exit(EXIT_DATA)


def print_error(message: str) -> None:
    """Print an error as one line on stderr."""
    print_line("error", message)


def is_quiet() -> bool:
    """Return whether the command that runs got the option ``--quiet``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(QUIET))


def print_note(message: str) -> None:
    """Print a note as one line on stderr, unless the command is quiet."""
    if not is_quiet():
        print_line("note", message)


def print_notes(messages: Iterable[str]) -> None:
    """Print each note as one line on stderr, unless the command is quiet."""
    for message in messages:
        print_note(message)


CLEAR = "\033[G\033[K"  # clears the line of a terminal; click writes it to no other stream

_OPTIONS = {
    r"Sizes\((\w+)=[^)]*\)+": r"--\1", r"islands='nearest'": "--islands nearest",
    "denoise needs a .*, got points: .*": "point clouds: leave out --scans and --denoise",
    r"prepare\(mesh, weld=([^)]*)\)": r"--weld \1",
    "is the radius in the unit of the mesh": "is -r in the unit of the file",
    r"(each number in counts|n_segments) must be": "-n must be",
    r"subdivide first, mesh = \S+subdivide\(.*\)\.mesh": "try --subdivide",
}  # fmt: skip
"""Options of the command, keyed by patterns in messages of the library."""


def print_line(kind: str, message: str) -> None:
    """Print an error or a note on stderr, even if the command is quiet."""
    for pattern, option in _OPTIONS.items():
        message = re.sub(pattern, option, message)
    click.echo(f"{CLEAR}superfacets: {kind}: {' '.join(message.split())}", err=True)
