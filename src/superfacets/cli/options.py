"""Types of options, groups of options in a help text, and options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from ..io.readers.read import CELL_ENDINGS


class CountOr(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click
    """An integer from `low` up, or a word."""

    name = "count or word"

    def __init__(self, word: str, low: int) -> None:
        self.word = word
        self.count = Count(low)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the word, or the number."""
        return value if value == self.word else self.count.convert(value, param, ctx)


class Count(click.IntRange):
    """Integers with a lower bound."""

    name = "count"

    def __init__(self, lowest: int) -> None:
        super().__init__(min=lowest)
        self._lowest = lowest

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; a usage error names the numbers that are allowed."""
        try:
            number = int(value)
        except ValueError:
            number = None
        if number is None or number < self._lowest:
            self.fail(f"{str(value)!r} is not a whole number of {self._lowest} or more", param, ctx)
        return number


class Real(click.FloatRange):
    """Finite numbers; click's FloatRange would accept NaN and infinity."""

    name = "number"

    def _describe_range(self) -> str:
        """The range in a help text; nothing if there is no bound, where click says x<=None."""
        return "" if self.min is None and self.max is None else super()._describe_range()

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number; a usage error names the numbers that are allowed."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{str(value)!r} is not a finite number", param, ctx)
        return float(super().convert(number, param, ctx))


class GroupedCommand(click.Command):
    """A command whose help lists options in groups; those of no group come last."""

    groups: Mapping[str, tuple[str, ...]] = {}
    """Names of parameters in each group, by title."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options."""
        rows = {param.name: param.get_help_record(ctx) for param in self.get_params(ctx)}
        listed = {
            title: [rows.pop(name, None) for name in names] for title, names in self.groups.items()
        }
        for title, records in {**listed, "Other options": [*rows.values()]}.items():
            shown = [record for record in records if record is not None]
            if shown:
                with formatter.section(title):
                    formatter.write_dl(shown)


FILE = click.Path(path_type=Path)
FOLDER = FILE
"""A folder for results; `writable_folder` creates and checks it."""

EXISTING_FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)
COUNT = Count(1)
POSITIVE = Real(min=0, min_open=True)
NOT_NEGATIVE = Real(min=0)

STANDARD_STREAM = "-"
"""Name of standard input and standard output."""

INPUT_FORMATS = tuple(ending.lstrip(".") for ending in CELL_ENDINGS)
"""Formats of meshes, then of point clouds."""

Decorator = Callable[[Any], Any]
"""A function that adds options to a command."""

ascii_option = click.option("--ascii", is_flag=True, help="Write .ply and .vtp files as text.")

labels_named_option = click.option(
    "--labels-named",
    metavar="NAME",
    default="label",
    show_default=True,
    help="Name of the labels in files that hold more, as .ply, .vtp, .vtu, .csv and .las do.",
)

quiet_option = click.option(
    "-q", "--quiet", "is_quiet", is_flag=True, help="Print nothing but errors."
)

threads_option = click.option(
    "--threads", "n_threads", type=COUNT, help="Threads to use.  [default: one per core]"
)


def format_option(what: str, *, name: str = "--format", of_stream: bool = False) -> Decorator:
    """Add the option that names the format of an input, which may be standard input."""
    stream = "; standard input by its content" if of_stream else ""
    return click.option(
        name,
        metavar="FORMAT",
        type=click.Choice(INPUT_FORMATS),
        help=f"Format of {what}: {', '.join(INPUT_FORMATS)}.  [default: by the ending{stream}]",
    )


def drop_attributes_option(what: str, listed: str = "") -> Decorator:
    """Add the option that drops all data of an input except the mesh."""
    return click.option(
        "--drop-attributes",
        is_flag=True,
        help=f"Do not carry over what a .ply {what} stores besides its mesh{listed}.",
    )


def camera_options(command: Any) -> Any:
    """Add the options for the viewpoint of a picture; a decorator of commands."""
    up = click.option(
        "--up",
        type=click.Choice(("auto", "x", "y", "z")),
        default="auto",
        show_default=True,
        help="Axis that points up; a guess between y and z by default.",
    )
    azimuth = click.option(
        "--azimuth", type=Real(), default=30.0, show_default=True, help="Degrees around."
    )
    elevation = click.option(
        "--elevation",
        type=Real(-90, 90),
        default=15.0,
        show_default=True,
        help="Degrees above the horizon.",
    )
    return up(azimuth(elevation(command)))


def label_options(command: Any) -> Any:
    """Add the options for labels in files; a decorator of commands."""
    named = click.option(
        "--label-name",
        default="label",
        show_default=True,
        help="Name of the array of labels in .vtp, .vtu and .vtk files; dental tools want Label.",
    )
    of_vertices = click.option(
        "--vertex-labels",
        is_flag=True,
        help="Store labels of the vertices, too, in .ply files.",
    )
    return named(of_vertices(command))


force_option = click.option(
    "--force",
    is_flag=True,
    help="Replace ground truth: an .aggregation.json from elsewhere, or a .segs.json that one"
    " refers to.",
)


def numbers(
    ctx: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[int, ...] | None:
    """Callback of options: integers >= 1 from a comma-separated list, ascending."""
    if text is None:
        return None
    wanted = [number.strip() for number in text.split(",")]
    for number in wanted:
        if not number.isdecimal() or not 1 <= int(number[:12]) < 2**31:
            raise click.BadParameter(f"expected whole numbers >= 1, got {number!r}", ctx, parameter)
    return tuple(sorted({int(number) for number in wanted}))
