"""Failures of files and of the machine, as one line and an exit status."""

from __future__ import annotations

import click

from ..errors import MeshError, MissingExtraError, RenderError

EXIT_DATA, EXIT_USAGE = 1, 2

FAILURES = (OSError, MeshError, MissingExtraError, RenderError, MemoryError)
"""Errors of files and of the machine. Any other ValueError is about a parameter."""


def message_of(error: BaseException) -> str:
    """Text of an error, starting with the file name if the system reports one."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'standard output'}: {error.strerror}"
    return str(error)


def print_error(message: str) -> None:
    """Print an error as one line on stderr."""
    _print("error", message)


def print_note(message: str) -> None:
    """Print a note as one line on stderr."""
    _print("note", message)


def _print(kind: str, message: str) -> None:
    one_line = " ".join(message.split())
    click.echo(f"superfacets: {kind}: {one_line}", err=True)
