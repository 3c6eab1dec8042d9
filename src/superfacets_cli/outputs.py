"""Plan, check and write output files of commands."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from superfacets import MeshAttributes, kit
from superfacets.kit import FORMATS, Cells, FormatOptions, Ints, OutputFiles, output_folder

from . import options as opts
from .failures import is_quiet, print_note, print_notes
from .inputs import name_of
from .options import option, options
from .progress import WaitBar
from .report import notes_on_numbers, notes_on_written

OUTPUT_FORMATS = tuple(FORMATS.ending_of)  # values of ``--to``

TO_IS_UNUSED = "--to has no effect: the endings of the output files given with -o set the formats"
"""Usage error if ``--to`` is given although all outputs have file names."""

TEXT_OUTPUTS = frozenset(
    (".obj", ".off", ".csv", ".seg", ".txt", ".segs.json", ".sstk.json", ".aggregation.json")
)

ASCII_OUTPUTS = frozenset((".ply", ".vtp", ".stl", ".vtu", ".vtk", ".pcd"))
"""File endings of formats that ``--ascii`` writes as text."""


def output_option(help: str, *, required: bool = False) -> opts.Decorator:
    """Add the option ``-o``, whose values are the `outputs` of `plan_jobs`."""
    return option("-o --output outputs OUT", opts.INPUT, help, multiple=True, required=required)


def to_option(about: str = "Output format when -o is a folder or omitted") -> opts.Decorator:
    """Add the option ``--to``, for the formats of outputs whose file name is not given."""
    text = (
        f"{about}, or several, separated by commas (see superfacets formats).  [default: ply; vtu"
        " for tetrahedra]"
    )
    return option("--to formats FORMAT", None, text, multiple=True, callback=listed_formats)


def listed_formats(
    ctx: click.Context, parameter: click.Parameter, given: tuple[str, ...]
) -> tuple[str, ...]:
    """Split comma-separated lists of formats into one tuple of names (a callback of click)."""
    names = opts.listed(ctx, parameter, given)
    for name in names:
        if name not in OUTPUT_FORMATS:
            known = ", ".join(OUTPUT_FORMATS)
            raise click.BadParameter(f"{name!r} is not one of {known}", ctx, parameter)
    return names


def one_output_options(what: str, name: str) -> opts.Decorator:
    """Add the options of `OneRun` to a command that processes a single input."""
    return options(
        output_option(
            f"Output file ({what}, in any format that segment writes), a folder (results/), or -"
            " for standard output; may be given several times."
            f"  [default: {name}.superfacets.ply beside {name}]"
        ),
        to_option(),
        opts.labels_named_option,
        opts.ascii_option,
        opts.force_option,
        opts.threads_option,
        opts.quiet_option(),
        opts.json_option(),
    )


MANY_FILES = 8  # reports list up to this number of output files one by one


@dataclass(frozen=True)
class Job:
    """One input and its outputs."""

    input: str
    files: tuple[Path, ...]
    stream: str | None = None  # file ending of the format on standard output; None if not used

    @property
    def holds_attributes(self) -> bool:
        """Whether some output can store attributes of vertices and faces."""
        return not self.endings.isdisjoint(FORMATS.attribute_outputs)

    @property
    def holds_labels(self) -> bool:
        """Whether some output stores labels, or data computed from labels, without the cells."""
        return not self.endings.issubset(FORMATS.cell_outputs)

    @property
    def endings(self) -> set[str]:
        """File endings of all outputs, which determine the formats."""
        return {kit.known_ending(path, FORMATS.outputs) for path in self.files} | (
            {self.stream} if self.stream else set()
        )

    @property
    def names(self) -> list[str]:
        """Outputs as on the command line: paths, and - for standard output."""
        return [*map(str, self.files), *([opts.STANDARD_STREAM] if self.stream else [])]

    @property
    def name(self) -> str:
        """Name of the input in reports, without its folder."""
        is_stream = self.input == opts.STANDARD_STREAM
        return name_of(self.input) if is_stream else Path(self.input).name

    def written(self, noun: str) -> list[str]:
        """Return a text for each output, for example ``a.npy (a label per face)``, for reports.

        More than `MANY_FILES` files are reported as their number and folder. `noun` is the word for
        a labeled cell.
        """
        if len(self.files) > MANY_FILES:
            return [f"{len(self.files)} files in {self.files[0].parent}"]
        files = [f"{path}{_labeled(path, noun)}" for path in self.files]
        return files if self.stream is None else [*files, "standard output"]

    def outputs(self, form: FormatOptions) -> OutputFiles:
        """Return the files and the stream, to write them in these formats."""
        return OutputFiles(
            self.files, form, {self.stream: sys.stdout.buffer} if self.stream else {}
        )

    def print(self, text: str) -> None:
        """Print on stdout, or on stderr if stdout is used for the result."""
        click.echo(text, err=self.stream is not None)

    def report(self, facts: Mapping[str, Any], text: str, noun: str) -> None:
        """Print `facts` with ``--json``, else a line per output and `text`, unless ``--quiet``."""
        if click.get_current_context().params["as_json"]:
            self.print(json.dumps({"file": self.input, **facts, "outputs": self.names}))
        elif not is_quiet():
            self.print("\n".join([*(f"wrote {name}" for name in self.written(noun)), text]))


def _labeled(path: Path, noun: str) -> str:
    """Return a text such as " (a label per face)" for a label file, and "" for other files."""
    ending = kit.known_ending(path, FORMATS.outputs)
    if ending in FORMATS.label_outputs:
        return f" (a label per {noun})"
    if ending in (*FORMATS.vertex_outputs, *FORMATS.key_labels):
        return f" (a label per {'point' if noun == 'point' else 'vertex'})"
    return ""


def names_of_results(text: str, endings: Sequence[str]) -> Sequence[str]:
    """Return file names for the results of an input: one per file ending, or a default name."""
    return kit.InputFile(text, Path(text).name).output_names(endings)


class OneRun:
    """Outputs and common options of a command that processes a single input."""

    def __init__(self, input: Path, also_read: Sequence[Path], given: dict[str, Any]) -> None:
        """Plan and check the outputs; `given` are the options of `one_output_options`."""
        ascii, force = given["ascii"], given["force"]
        read = [str(path) for path in also_read]
        (self.job,) = plan_jobs(
            (str(input),), given["outputs"], given["formats"], ascii=ascii, also_read=read
        )
        self.outputs = self.job.outputs(FormatOptions(ascii=ascii, force=force))
        self.outputs.check()
        self.keeps_attributes = self.job.holds_attributes and not given.get("drop_attributes")
        self.labels_named: str = given["labels_named"]
        self.n_threads: int | None = given["n_threads"]

    def write(
        self, cells: Cells, labels: Ints, attributes: MeshAttributes | None = None,
        notes: Iterable[str] = (), of_vertices: Mapping[str, Any] | None = None, **form: Any,
    ) -> None:  # fmt: skip
        """Write the outputs; print `notes`, and notes on data that the outputs do not store.

        `of_vertices` are arguments of `OutputFiles.write` for labels of vertices.
        """
        outputs = replace(self.outputs, options=replace(self.outputs.options, **form))
        with WaitBar():
            written = outputs.write(cells, labels, attributes=attributes, **(of_vertices or {}))
        lacking = notes_on_written(cells, attributes, self.job.endings, written)
        numbers = notes_on_numbers(labels, self.job.endings, written.region_sizes)
        print_notes([*notes, *lacking, *numbers])

    def report(self, facts: Mapping[str, Any], text: str, noun: str = "face") -> None:
        """Print `facts` with ``--json``, else a line per output and `text`, unless ``--quiet``."""
        self.job.report(facts, f"{self.job.name}: {text}", noun)


def plan_jobs(
    inputs: Sequence[str], outputs: Sequence[str], formats: Sequence[str], *, ascii: bool,
    also_read: Sequence[str] = (),
) -> list[Job]:  # fmt: skip
    """Return the job of each input; raise a usage error if the command line is ambiguous.

    `inputs` are files, or one ``-``. `outputs` are files, a folder, or ``-``. Without `outputs`,
    results are written to the folder of each input, or to standard output for standard input.
    `formats` apply to outputs whose file name is not given (default: PLY, or VTU for tetrahedra).
    With `ascii`, meshes are written as text, so standard output may be a terminal. No output may
    overwrite a file of `also_read`.
    """
    folders = [text for text in outputs if _is_folder(text)]
    _check_outputs(inputs, outputs, folders)
    has_stream = opts.STANDARD_STREAM in outputs or (not outputs and opts.STANDARD_STREAM in inputs)
    _check_formats(formats, has_stream, is_used=has_stream or bool(folders) or not outputs)
    endings = tuple(FORMATS.ending_of[format] for format in formats)
    stream = (*endings, ".ply")[0] if has_stream else None
    if stream is not None:
        check_terminal(stream, ascii)
    named = [Path(text) for text in outputs if text not in (opts.STANDARD_STREAM, *folders)]
    jobs = []
    for text in inputs:
        files = list(named)
        if folders:
            files += [Path(folders[0], name) for name in names_of_results(text, endings)]
        elif not outputs and text != opts.STANDARD_STREAM:
            beside = _folder_beside(text)
            files += [beside / name for name in names_of_results(text, endings)]
        jobs.append(Job(text, tuple(files), stream))
    check_files(jobs, also_read)
    for folder in folders:
        click.get_current_context().with_resource(output_folder(Path(folder)))
    return jobs


def _folder_beside(text: str) -> Path:
    """Return an input's folder, or the current folder if the input or its folder is read-only."""
    path = Path(text)
    if not path.exists():  # reading the input will report the error
        return path.parent
    if path.parent.samefile(Path()):
        return Path()
    for place in (path, path.parent):
        if not (os.access(place, os.W_OK) and place.stat().st_mode & 0o222):
            print_note(f"{place} is read-only: results are written to the current folder")
            return Path()
    return path.parent


def _is_folder(text: str) -> bool:
    """Return whether a path ends in a slash, or is a folder whose name has no known ending."""
    if text.endswith(("/", os.sep)):
        return True
    return bool(text) and Path(text).is_dir() and not text.lower().endswith(FORMATS.outputs)


def _check_outputs(inputs: Sequence[str], outputs: Sequence[str], folders: list[str]) -> None:
    for text in outputs:
        if text == opts.STANDARD_STREAM or text in folders:
            continue
        if not Path(text).name:
            raise click.UsageError(f"{text or repr(text)} is not a file name")
        try:
            kit.known_ending(Path(text), FORMATS.outputs)
        except ValueError as error:
            is_file = Path(text).is_file() or Path(text).suffix.lower() in FORMATS.meshes
            hint = "" if is_file else f" (for a folder, write {text}/)"
            raise click.UsageError(f"{error}{hint}") from None
        if len(inputs) > 1:
            raise click.UsageError(
                f"{text} is one file for {len(inputs)} inputs: give -o a folder, such as results/"
            )
    if list(outputs).count(opts.STANDARD_STREAM) > 1 or len(folders) > 1:
        raise click.UsageError("give -o at most one folder, and at most once - (standard output)")
    if opts.STANDARD_STREAM in outputs and len(inputs) > 1:
        raise click.UsageError(f"-o - writes one result, but there are {len(inputs)} inputs")
    if folders and opts.STANDARD_STREAM in inputs:
        raise click.UsageError("standard input has no file name: give -o a file, not a folder")


def _check_formats(formats: Sequence[str], has_stream: bool, *, is_used: bool) -> None:
    if formats and not is_used:
        raise click.UsageError(TO_IS_UNUSED)
    if has_stream and len(formats) > 1:
        raise click.UsageError("standard output can have one format only: give --to once")
    if len(set(formats)) < len(formats):
        raise click.UsageError("--to names the same format twice")


def check_terminal(stream: str, ascii: bool) -> None:
    """Raise a usage error if a binary format would be written to a terminal.

    `stream` is the file ending of the format. Raises OSError if standard output is closed.
    """
    if sys.stdout is None:
        raise OSError("standard output is closed")
    is_binary = stream not in TEXT_OUTPUTS and not (ascii and stream in ASCII_OUTPUTS)
    if is_binary and sys.stdout.isatty():
        raise click.UsageError(
            "standard output is a terminal, which cannot show binary data: give -o a file,"
            " or --to txt"
        )


def check_files(jobs: Sequence[Job], also_read: Sequence[str]) -> None:
    """Raise a usage error if an output would overwrite an input or another output.

    An input that is given twice is a usage error, too.
    """
    inputs = {_identity(job.input): job.input for job in jobs if job.input != opts.STANDARD_STREAM}
    if len(inputs) < sum(job.input != opts.STANDARD_STREAM for job in jobs):
        raise click.UsageError("the same input is given twice")
    inputs |= {_identity(path): path for path in also_read}
    writers: dict[tuple[int, int] | str, str] = {}
    for job in jobs:
        for path in job.files:
            identity = _identity(path)
            if identity in inputs:
                raise click.UsageError(f"{inputs[identity]}: the output would overwrite the input")
            if writers.get(identity) == job.input:
                raise click.UsageError(f"{path}: the same output is given twice")
            if identity in writers:
                raise click.UsageError(
                    f"{name_of(writers[identity])} and {name_of(job.input)} would both be written"
                    f" to {path}"
                )
            writers[identity] = job.input


def _identity(path: str | Path) -> tuple[int, int] | str:
    """Return a key that is equal for all paths of the same file, including links."""
    try:
        found = Path(path).stat()
    except OSError:
        return os.path.normcase(os.path.realpath(path))
    return found.st_dev, found.st_ino


def check_mask(endings: Iterable[str], *, has_mask: bool) -> None:
    """Raise a usage error if there is a mask, but a format needs a label for every cell."""
    refusing = sorted({*endings} & {*FORMATS.vertex_outputs})
    if has_mask and refusing:
        raise click.UsageError(
            f"{refusing[0]} files cannot store cells that a mask leaves out: use another format"
        )
