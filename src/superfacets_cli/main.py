"""Define the group of commands, and end the process with an exit status."""

from __future__ import annotations

import contextlib
import os
import sys
import warnings
from difflib import get_close_matches
from pathlib import Path
from typing import NoReturn

import click

from superfacets import __version__
from superfacets.kit import Table

from .failures import EXIT_DATA, EXIT_USAGE, FAILURES, message_of, print_error, print_note
from .interrupts import EXIT_INTERRUPTED, INTERRUPTED, end_at_signals, hear_signals, is_busy

GROUPS = {
    "Segment": {
        "segment": "Segment meshes and clouds; superfacets FILE does the same.",
        "levels": "Segment a mesh or cloud, and merge regions level by level.",
        "batch": "Segment thousands of files on all cores, or on a cluster.",
        "demo": "Segment the sample mesh of the package.",
    },
    "Look and label": {
        "info": "Print counts and sizes of meshes and point clouds.",
        "render": "Draw a picture of a mesh or point cloud with its regions.",
        "view": "Show a mesh or point cloud with its regions in a browser.",
        "studio": "Label a mesh, a cloud or all files of a folder in a browser.",
        "agree": "Compare two people's work in the studio, and merge it.",
    },
    "Work with labels": {
        "convert": "Write meshes with their labels in other formats.",
        "formats": "List the formats of files.",
        "regions": "Measure regions: areas, shapes, neighbors.",
        "cut": "Cut a mesh along smooth borders of its regions.",
        "transfer": "Transfer labels to another mesh or cloud of the same object.",
        "lift": "Label regions of a mesh with image masks.",
        "evaluate": "Measure the quality of labels.",
    },
}
"""Summaries of all commands, so that the main help text needs no imports."""

_MODULES = {
    "agree": "studio", "cut": "lift", "demo": "segment", "evaluate": "info", "formats": "info",
    "transfer": "lift", "view": "render",
}  # fmt: skip
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
    end_at_signals()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # more threads busy-wait, but do no work
    warnings.showwarning = _show_warning
    warnings.simplefilter("default", UserWarning)
    try:
        status = group.main(prog_name=name, standalone_mode=False)
    except click.UsageError as error:
        place = error.ctx.command_path if error.ctx else name
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

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; a file in place of a command is segmented."""
        name, known = args[0], COMMANDS if args[0] in COMMANDS else self.list_commands(ctx)
        if name not in known and _is_input(name):
            return super().resolve_command(ctx, ["segment", *args])
        near = get_close_matches(name, known, 1)
        advice = f"did you mean {near[0]}?" if near else _in_python(name)
        if name not in known and advice:
            raise click.UsageError(f"No such command {name!r}: {advice}", ctx)
        return super().resolve_command(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return [*COMMANDS, *_other_commands()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command with this name, or None if the name is unknown."""
        table = COMMANDS if cmd_name in COMMANDS else _other_commands()
        if cmd_name not in table:
            return None
        command: click.Command = table[cmd_name]
        hear_signals()
        return command

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands."""
        others = {name: f"From {target!r}." for name, target in _other_commands().items()}
        groups = GROUPS | ({"Other packages": others} if others else {})
        for title, summaries in groups.items():
            with formatter.section(title):
                formatter.write_dl(list(summaries.items()))


def _is_input(text: str) -> bool:
    """Return whether an argument is the name of a file or folder, or ``-`` for standard input."""
    return text == "-" or Path(text).exists() or bool(Path(text).suffix)


def _in_python(name: str) -> str | None:
    """Return advice if the name of exactly one Python function contains these words, or None."""
    words = name.strip("-").replace("-", "_")
    found = [each for each in dir(sys.modules["superfacets"]) if f"_{words}_" in f"_{each}_"]
    return f"in Python: superfacets.{found[0]}" if len(found) == 1 else None


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,  # click 8.1 and 8.2 differ otherwise in the exit status
    options_metavar="[--version]",
    subcommand_metavar="COMMAND|FILE [-h] [ARGS]...",
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, message="superfacets %(version)s")
@click.pass_context
def commands(ctx: click.Context) -> None:
    """Divide meshes into compact, connected regions whose borders follow creases."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
        ctx.exit(EXIT_USAGE)


OTHER_OPTIONS = {
    "--compactness": "use --alpha, the opposite: higher values follow creases more",
    "--sigma": "use --denoise",
    **dict.fromkeys(("-k", "--k", "--n", "--kThresh", "--n-clusters", "--n-superpoints"), "use -n"),
    **dict.fromkeys(("-j", "--jobs", "--n-jobs", "--num-threads"), "use --threads"),
    **dict.fromkeys(("--voxel-size", "--seed-resolution"), "use --radius, in the unit of the file"),
    **dict.fromkeys(("--gpu", "--cuda", "--device"), "leave it out: computations run on the CPU"),
    **dict.fromkeys(("-n", "--n-segments", "-r"), "superfacets segment makes the regions"),
    "--classes": "names of regions are given in Python: write_mesh(..., classes=...)",
    **dict.fromkeys(("--min-size", "--segMinVerts"), "merge small regions in Python instead"),
}  # fmt: skip
"""Advice for options that other tools have."""

_ON_MORE = {"studio": "import labels in the browser", "levels": "put commas between numbers of -n"}
"""Advice for extra arguments, by command."""


def _text_of(error: click.UsageError) -> str:
    """Return the message of a usage error, with advice on an option of another tool."""
    if not isinstance(error, click.NoSuchOption) or error.ctx is None:
        is_more = error.ctx is not None and "extra argument" in error.message
        advice = _ON_MORE.get(error.ctx.info_name or "") if error.ctx and is_more else None
        return error.format_message() + (f": {advice}" if advice else "")
    if isinstance(error.ctx.command, click.Group):
        return f"{error.format_message()} (options follow the command, or the file)"
    advice = OTHER_OPTIONS.get(error.option_name) or _in_python(error.option_name)
    known = {name for each in error.ctx.command.params for name in each.opts}
    words = (advice or "").replace(",", "").split()
    if advice is None or (words[0] == "use" and words[1] not in known):
        return error.format_message()
    return f"No such option: {error.option_name}: {advice}"


def _fail(message: str, status: int) -> NoReturn:
    print_error(message)
    sys.exit(status)


def _interrupted() -> NoReturn:
    with contextlib.suppress(OSError):  # the terminal may be closed
        print_error(INTERRUPTED)
        sys.stdout.flush()
    if is_busy():
        # Shutting down the interpreter while a thread still runs in the C++ core could crash.
        os._exit(EXIT_INTERRUPTED)
    sys.exit(EXIT_INTERRUPTED)
