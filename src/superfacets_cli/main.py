"""Define the group of commands, and end the process with an exit status."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import warnings
from typing import NoReturn

import click

from superfacets import __version__
from superfacets.kit import Table

from .failures import EXIT_DATA, EXIT_USAGE, FAILURES, message_of, print_error, print_note
from .interrupts import EXIT_INTERRUPTED, INTERRUPTED, hear_signals, is_busy, while_importing

GROUPS = {
    "Segment": {
        "segment": "Segment meshes and point clouds, and write their labels.",
        "levels": "Segment a mesh or point cloud, and merge regions level by level.",
        "batch": "Segment thousands of files on all cores, or on a cluster.",
        "demo": "Segment the sample mesh of the package.",
    },
    "Look and label": {
        "info": "Print counts and sizes of meshes and point clouds.",
        "render": "Draw a picture of a mesh or point cloud with its regions.",
        "view": "Show a mesh or point cloud with its regions in a browser.",
        "studio": "Label a mesh or point cloud, or all files of a folder, in a browser.",
        "agree": "Compare two people's work in the studio, and merge it.",
    },
    "Work with labels": {
        "convert": "Write meshes with their labels in other formats.",
        "regions": "Measure regions: areas, shapes, neighbors.",
        "cut": "Cut a mesh along smooth borders of its regions.",
        "transfer": "Transfer labels to another mesh or point cloud of the same object.",
        "lift": "Label regions of a mesh with image masks.",
        "evaluate": "Measure the quality of labels.",
    },
}
"""Summaries of all commands, so that the main help text needs no imports."""

_MODULES = {"agree": "studio"}
"""Module of each command whose module has a different name."""

COMMANDS = Table({
    name: f"superfacets_cli.{_MODULES.get(name, name)}:{name}_command"
    for group in GROUPS.values() for name in group
})  # fmt: skip
"""Commands of this package, by name."""


def _other_commands() -> Table:
    """Return commands that other packages add by entry points of `superfacets.commands`."""
    found = Table.added("superfacets.commands").items()
    return Table({name: target for name, target in found if name not in COMMANDS})


def main() -> NoReturn:
    """Run the command line. An error is reported by one line on stderr and by the exit status."""
    run(commands, "superfacets")


def run(group: click.Group, name: str) -> NoReturn:
    """Run a group of commands, which is called `name` in messages, and exit."""
    hear_signals()
    warnings.showwarning = _show_warning
    try:
        status = group.main(prog_name=name, standalone_mode=False)
    except click.UsageError as error:
        place = error.ctx.command_path if error.ctx else _command_path(group, name)
        _fail(f"{_text_of(error)} (see {place} --help)", EXIT_USAGE)
    except click.Abort:
        _interrupted()
    except FAILURES as error:
        _fail(message_of(error), EXIT_DATA)
    except ValueError as error:  # a wrong parameter or environment variable
        _fail(str(error), EXIT_USAGE)
    sys.exit(status if isinstance(status, int) else 0)


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Print a warning, for example of a library about a damaged file, as a note of one line."""
    if {"-q", "--quiet"}.isdisjoint(sys.argv):
        print_note(str(message)[:200])


class LazyGroup(click.Group):
    """A group of commands, each imported only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return [*COMMANDS, *_other_commands()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command with this name, or None if the name is unknown."""
        table = COMMANDS if cmd_name in COMMANDS else _other_commands()
        if cmd_name not in table:
            return None
        with while_importing():
            command: click.Command = table[cmd_name]
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands."""
        others = {name: f"From {target!r}." for name, target in _other_commands().items()}
        sections = {**GROUPS, "Other packages": others} if others else GROUPS
        for title, summaries in sections.items():
            with formatter.section(title):
                formatter.write_dl(list(summaries.items()))


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,  # click 8.1 and 8.2 differ otherwise in the exit status
    subcommand_metavar="COMMAND [ARGS]...",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit status: 0 on success, 1 if a file could not be processed, 2 if the command line is"
    " wrong, 130 after Ctrl-C, SIGTERM or SIGHUP.",
)
@click.version_option(__version__, message="superfacets %(version)s")
@click.pass_context
def commands(ctx: click.Context) -> None:
    """Oversegment meshes into superfacets: compact, connected regions that follow the creases."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
        ctx.exit(EXIT_USAGE)


def _text_of(error: click.UsageError) -> str:
    """Return the message of a usage error; if another tool has the option, suggest ours."""
    if not isinstance(error, click.NoSuchOption):
        return error.format_message()
    from superfacets.kit import FileOptions

    hint = FileOptions.advice_on(error.option_name.lstrip("-").replace("-", "_"))
    ours = {p.name: p.opts for p in error.ctx.command.params} if error.ctx else {}
    verb, _, rest = hint.partition(" ")
    name = re.split(r"\W", rest, maxsplit=1)[0]
    if verb != "use" or name not in ours:
        return error.format_message()
    option = max(ours[name], key=len)
    return f"No such option: {error.option_name}: use {option}{rest.removeprefix(name)}"


def _command_path(group: click.Group, name: str) -> str:
    """Return `name` and the command's name, for usage errors of click without a context."""
    known = group.list_commands(click.Context(group))
    return " ".join([name, *(word for word in sys.argv[1:2] if word in known)])


def _fail(message: str, status: int) -> NoReturn:
    print_error(message)
    sys.exit(status)


def _interrupted() -> NoReturn:
    with contextlib.suppress(OSError):  # the terminal may be closed
        print_error(INTERRUPTED)
    if is_busy():
        # Shutting down the interpreter while a thread still runs in the C++ core could crash.
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(EXIT_INTERRUPTED)
    sys.exit(EXIT_INTERRUPTED)
