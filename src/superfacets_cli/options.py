"""Define option types, grouped help texts, and options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import click

from superfacets.kit import FORMATS

from .failures import QUIET


class Count(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click
    """Type of options whose value is an integer of at least `least`, or one of the `words`."""

    name = "count"

    def __init__(self, least: int, *words: str) -> None:
        self._least, self._words = least, words

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the word or the number."""
        text = str(value)
        if not (text in self._words or (text.isdecimal() and int(text) >= self._least)):
            words = "".join(f", or {word}" for word in self._words)
            self.fail(f"{text!r} is not a whole number of {self._least} or more{words}", param, ctx)
        return text if text in self._words else int(text)


class Real(click.FloatRange):
    """Type of options with a finite number in a range. FloatRange also accepts NaN and infinity."""

    name = "number"

    def _describe_range(self) -> str:
        """Return the range for the help text if it has two bounds."""
        return "" if self.min is None or self.max is None else super()._describe_range()

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or raise a usage error."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{str(value)!r} is not a finite number", param, ctx)
        return number


class Listed(click.ParamType):  # type: ignore[type-arg]  # generic in new versions of click
    """Type of comma-separated lists, whose items have another type."""

    name = "list"

    def __init__(self, of: Any = click.STRING) -> None:
        self._of = of

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the items as a tuple."""
        if isinstance(value, tuple):
            return value
        items = [item.strip() for item in value.split(",")]
        if not all(items):
            self.fail("an item is empty", param, ctx)
        if self._of is not click.STRING and any(" " in item for item in items):
            self.fail(f"{value!r} needs commas between its items", param, ctx)
        return tuple(self._of.convert(item, param, ctx) for item in items)


class GroupedCommand(click.Command):
    """A command whose help lists options by the `group` that was passed to `options`.

    ``--help`` shows the groups in `SHOWN`, and ``--help-all`` shows all groups.
    """

    GROUPS: ClassVar = (
        "Everyday options", "Presets", "Creases and borders", "Equal, bounded and exact sizes",
        "Data that borders follow", "Noise, long faces, clouds", "Seeds and the loop", "Files",
        "Running", "Other options",
    )  # fmt: skip
    SHOWN: ClassVar = (*GROUPS[:2], GROUPS[-1])

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options group by group; options without a group come last."""
        given = [each for each in self.get_params(ctx) if isinstance(each, click.Option)]
        for title in self.GROUPS if ALL_OPTIONS in ctx.meta else self.SHOWN:
            options = [each for each in given if getattr(each, "group", self.GROUPS[-1]) == title]
            records = [record for each in options if (record := each.get_help_record(ctx))]
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


ALL_OPTIONS = "superfacets.help-all"  # key in `Context.meta`


def _show_all(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        ctx.meta[ALL_OPTIONS] = True
        click.echo(ctx.get_help())
        ctx.exit()


FILE = click.Path(path_type=Path)
FOLDER = FILE  # type of an output folder, which `output_folder` creates

INPUT = click.Path(allow_dash=True)  # type of a file, or - for standard input

EXISTING_FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)
COUNT = Count(1)
USUAL_COUNT = 150  # number of regions if no option says how many, or how large
POSITIVE, NOT_NEGATIVE = Real(min=0, min_open=True), Real(min=0)
FLAG = object()  # the `kind` of an option without a value, see `option`

STANDARD_STREAM = "-"  # name of standard input and standard output

INPUT_FORMATS = tuple(ending.lstrip(".") for ending in FORMATS.cells)
"""Input formats: formats of meshes first, then formats of point clouds."""

Decorator = Callable[[Any], Any]  # a function that adds options to a command


def option(words: str, kind: Any, help: str, **settings: Any) -> Decorator:
    """Add an option to a command.

    `words` are separated by spaces: the names of the option, the name of the parameter if it
    differs from these names, and the metavar in capitals. `kind` is a click type, a tuple of
    choices, `FLAG`, or None for text. `settings` are further arguments of `click.option`.
    """
    if isinstance(kind, Listed) and settings.get("multiple"):
        settings["callback"] = lambda _ctx, _param, lists: tuple(chain(*lists))
    names = words.split()
    if not names[-1].startswith("-") and not names[-1].islower():
        settings.setdefault("metavar", names.pop())
    if kind is FLAG:
        settings["is_flag"] = True
    else:
        settings["type"] = click.Choice(kind) if isinstance(kind, tuple) else kind
    settings.setdefault("show_default", settings.get("default") is not None)
    return click.option(*names, help=help, **settings)


def options(*given: Decorator, group: str | None = None) -> Decorator:
    """Add several options to a command, in this order; its help lists them under `group`."""

    def decorate(command: Any) -> Any:
        n_later = len(getattr(command, "__click_params__", ()))
        for add in reversed(given):  # click lists the last added option first
            command = add(command)
        for param in command.__click_params__[n_later:] if group else ():
            param.group = group
        return command

    return decorate


def format_option(what: str, *, name: str = "--format", of_stream: bool = False) -> Decorator:
    """Add the option for the format of an input, which may be standard input if `of_stream`."""
    stream = ", or from the content of standard input" if of_stream else ""
    text = f"Format of {what} (see superfacets formats).  [default: from the file ending{stream}]"
    return option(f"{name} FORMAT", INPUT_FORMATS, text)


def drop_attributes_option(what: str, listed: str = "") -> Decorator:
    """Add the option that drops all data of an input except the mesh."""
    text = f"Do not copy data of {what} besides the mesh or points to the output{listed}."
    return option("--drop-attributes", FLAG, text)


def json_option(what: str = "the results as JSON") -> Decorator:
    """Add the option ``--json``, for output that programs read."""
    return option("--json as_json", FLAG, f"Print {what}.")


def _keep_labels(ctx: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Return LABELS, or the value of its synonym ``--labels`` (a callback of click for both)."""
    key = "superfacets.labels"
    if parameter.param_type_name == "option":
        ctx.meta[key] = path
        return None
    synonym: Path | None = ctx.meta[key]
    if path is not None and synonym is not None:
        raise click.UsageError("labels are given twice: as LABELS and with --labels")
    return synonym if path is None else path


labels_argument = options(
    click.argument("labels", metavar="[LABELS]", type=FILE, required=False, callback=_keep_labels),
    option("--labels also_labels L", FILE, "Same as LABELS.", is_eager=True, expose_value=False,
           callback=_keep_labels),
)  # fmt: skip
"""Add the argument LABELS, which may be missing, and its synonym ``--labels``."""

help_all_option = option(
    "--help-all", FLAG, "Show all options and exit.", is_eager=True, expose_value=False,
    callback=_show_all,
)  # fmt: skip
ascii_option = option("--ascii", FLAG, "Write .ply, .pcd, .stl, .vtp, .vtu and .vtk as text.")


def quiet_option(about: str = "Print only errors.") -> Decorator:
    """Add the option ``--quiet``, which `failures.is_quiet` reads."""
    return option("-q --quiet is_quiet", FLAG, about, expose_value=False,
                  callback=lambda ctx, _, value: ctx.meta.update({QUIET: value}))  # fmt: skip


threads_option = option("--threads n_threads", COUNT, "Number of threads.  [default: one per core]")
viewpoint_option = option(
    "--viewpoint X,Y,Z", Listed(Real()),
    "Position of the scanner, for point clouds without normals: estimated normals point to it.",
)  # fmt: skip
force_option = option(
    "--force", FLAG,
    "Overwrite ground truth: .segs.json or .aggregation.json of another tool, or segments in use.",
)  # fmt: skip
labels_named_option = option(
    "--labels-named NAME", None,
    "Name of the labels in input files with other data, such as .ply, .vtp, .csv and .las.",
    default="label",
)  # fmt: skip
label_options = options(
    option("--label-name", None,
           "Name of the label array in .vtp, .vtu and .vtk outputs; dental tools expect Label.",
           default="label"),
    option("--vertex-labels", FLAG, "Also store a label for each vertex in .ply files."),
)  # fmt: skip
up_option = option("--up", ("auto", "x", "y", "z"), default="auto",
    help="Axis that points up; auto is z for LAS and E57, otherwise a guess, y or z.")  # fmt: skip
drawing_options = options(
    up_option,
    option("--azimuth", Real(), "Direction of the camera around the up axis, in degrees.",
           default=30.0),
    option("--elevation", Real(-90, 90), "Angle of the camera above the horizon, in degrees.",
           default=15.0),
    option("--smooth-borders", FLAG, "Draw borders between regions of a mesh as smooth curves."),
)  # fmt: skip
