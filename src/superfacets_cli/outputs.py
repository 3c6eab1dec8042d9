"""Plan, check, write and report output files of commands."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import MeshAttributes, kit
from superfacets.kit import FORMATS, Cells, FormatOptions, Ints, OutputFiles

from . import options as opts
from .failures import is_quiet, print_notes
from .inputs import name_of
from .options import option, options
from .progress import Progress
from .report import notes_on_written

TEXT_OUTPUTS = frozenset((".obj", ".off", ".csv", ".seg", ".txt", ".segs.json", ".sstk.json",
                          ".aggregation.json"))  # fmt: skip


def output_option(help: str, *, required: bool = False) -> opts.Decorator:
    """Add the option ``-o``, whose values are the `outputs` of `plan_jobs`."""
    return option("-o --output outputs OUT", opts.INPUT, help, multiple=True, required=required)


def to_option(names: str = "--to") -> opts.Decorator:
    """Add the option ``--to``, for the formats of outputs whose file name is not given."""
    return option(
        f"{names} formats FORMAT", opts.Listed(click.Choice([*FORMATS.ending_of])),
        "Output format when -o is a folder or omitted, or several, separated by commas (see"
        " superfacets formats).  [default: las for .las, laz for .laz, vtu for .vtu, .vtk, .msh and"
        " .mesh, ply for others]", multiple=True,
    )  # fmt: skip


def one_output_options(what: str, name: str) -> opts.Decorator:
    """Add the options of a command that writes the result of a single input."""
    return options(
        output_option(
            f"Output file ({what}, in any format that segment writes), a folder (results/), or -"
            " for standard output. This option may be given several times."
            f"  [default: {name}.superfacets.FORMAT beside {name}, see --to]"),
        to_option(), opts.labels_named_option, opts.ascii_option, opts.force_option,
        opts.threads_option, opts.quiet_option(), opts.json_option(),
    )  # fmt: skip


@dataclass(frozen=True)
class Job:
    """One input and its outputs."""

    input: str
    files: tuple[Path, ...]
    stream: str | None = None  # file ending of the format on standard output; None if not used
    form: FormatOptions = field(default_factory=FormatOptions)
    keeps: bool = True  # whether the outputs get attributes of the input, if they can store them

    @property
    def outputs(self) -> OutputFiles:
        """The files and the stream, to write them."""
        streams = {self.stream: sys.stdout.buffer} if self.stream else {}
        return OutputFiles(self.files, self.form, streams)

    @property
    def endings(self) -> set[str]:
        """File endings of all outputs, which determine the formats."""
        return self.outputs.endings

    @property
    def keeps_attributes(self) -> bool:
        """Whether some output gets attributes of vertices and faces."""
        return self.keeps and not self.endings.isdisjoint(FORMATS.attribute_outputs)

    def write(
        self, cells: Cells, labels: Ints | None, attributes: MeshAttributes | None = None, *,
        form: Mapping[str, Any] | None = None, names: Mapping[int, str] | None = None, **more: Any,
    ) -> None:  # fmt: skip
        """Write the outputs, and print notes on data that the outputs do not store.

        `form` changes options of formats, `names` is by label, `more` is for `OutputFiles.write`.
        """
        numbers = labels if more.get("of_vertices") is None else more["of_vertices"]
        if names and numbers is not None:
            values = np.unique(numbers[numbers >= 0]).tolist()
            form = {"classes": tuple(names.get(value, f"region_{value}") for value in values)}
            if lacking := sorted(self.endings.difference(FORMATS.class_outputs)):
                print_notes([f"names of regions are not stored in {' and '.join(lacking)}"])
        outputs = replace(self.outputs, options=replace(self.form, **(form or {})))
        with Progress():
            written = outputs.write(cells, labels, attributes=attributes, **more)
        print_notes(notes_on_written(numbers, attributes, self.endings, written))

    def report(
        self, facts: Mapping[str, Any], text: str, noun: str = "face", more: Sequence[str] = ()
    ) -> None:
        """Print a report, see `print_report`.

        `noun` names a labeled cell ("face of a.stl"), and `more` are other files that were written.
        """
        is_json = click.get_current_context().params["as_json"]
        files = [f"{path}{'' if is_json else _labeled(path, noun)}" for path in self.files]
        print_report(self.input, [*files, *more], facts, text, has_stream=self.stream is not None)


def print_report(
    input: str, files: Sequence[str], facts: Mapping[str, Any], text: str, *, has_stream: bool
) -> None:
    """Print `facts` with ``--json``, nothing with ``--quiet``, else a line per file and `text`.

    The report is printed on stderr if stdout is used for the result (`has_stream`).
    """
    if click.get_current_context().params["as_json"]:
        outputs = [*files, *([opts.STANDARD_STREAM] if has_stream else [])]
        click.echo(json.dumps({"file": input, **facts, "outputs": outputs}), err=has_stream)
    elif not is_quiet():
        lines = [*(f"wrote {name}" for name in files), f"{name_of(Path(input).name)}: {text}"]
        click.echo("\n".join(lines), err=has_stream)


def _labeled(path: Path, noun: str) -> str:
    """Return a text such as " (a label per face)" for a label file, and "" for other files."""
    if kit.known_ending(path, FORMATS.outputs) in FORMATS.label_outputs:
        return f" (a label per {noun})"
    if kit.known_ending(path, FORMATS.outputs) in (*FORMATS.vertex_outputs, *FORMATS.key_labels):
        cell, *of_file = noun.split(" ", 1)
        return f" (a label per {' '.join(['point' if cell == 'point' else 'vertex', *of_file])})"
    return ""


def plan_jobs(
    inputs: Sequence[str], given: Mapping[str, Any], also_read: Iterable[Path | None] = ()
) -> list[Job]:
    """Return the job of each input; raise a usage error if the command line is ambiguous.

    `inputs` are files, or one ``-``. `given` are options of the command. Its `outputs` are files, a
    folder, or ``-``. Without `outputs`, results are written to the folder of each input, or to
    standard output for standard input. The `formats` apply to outputs whose file name is not given
    (default: `InputFile.usual_ending`). No output may overwrite a file of `also_read`.
    """
    outputs, formats = given["outputs"], given.get("formats", ())
    folders = [text for text in outputs if _is_folder(text)]
    named = [Path(text) for text in outputs if text not in (opts.STANDARD_STREAM, *folders)]
    has_stream = opts.STANDARD_STREAM in (outputs or inputs)
    _check_outputs(inputs, named, folders, has_stream)
    if formats and not (has_stream or folders or not outputs):
        raise click.UsageError(
            "--to has no effect: the endings of the output files given with -o set the formats"
        )
    if has_stream and len(formats) > 1:
        raise click.UsageError("standard output can have one format only: give --to once")
    endings = tuple(FORMATS.ending_of[format] for format in formats)
    stream = (*endings, ".ply")[0] if has_stream else None
    _check_stream(stream, is_text=given.get("ascii", False))
    form = {name: given[name] for name in FormatOptions.__dataclass_fields__ if name in given}
    jobs, las = [], {".las", ".laz"}
    for text in inputs:
        files = list(named)
        if folders or not (outputs or has_stream):
            place = Path(folders[0]) if folders else _folder_beside(Path(text))
            names = kit.InputFile(text, Path(text).name or "-").output_names(endings)
            files += [place / name for name in names]
        job = Job(text, tuple(files), stream, keeps=not given.get("drop_attributes"))
        jobs.append(replace(job, form=FormatOptions.checked([*job.endings], **form)))
        if not job.keeps and Path(text).suffix.lower() in las and not las.isdisjoint(job.endings):
            print_notes([f"{text}: its reference system, scale and offset are dropped, too"])
    check_files(jobs, also_read)
    for folder in folders:
        click.get_current_context().with_resource(kit.output_folder(Path(folder)))
    return jobs


def one_job(
    input: str | Path, given: Mapping[str, Any], also_read: Iterable[Path | None] = ()
) -> Job:
    """Return the job of a command with one input, after a check whether it can be written."""
    (job,) = plan_jobs((str(input),), given, also_read)
    job.outputs.check()
    return job


def _folder_beside(path: Path) -> Path:
    """Return an input's folder, or the current folder if the input or its folder is read-only."""
    if not path.exists():  # reading the input will report the error
        return path.parent
    if path.parent.samefile(Path()):
        return Path()
    for place in (path, path.parent):
        if not (os.access(place, os.W_OK) and place.stat().st_mode & 0o222):
            print_notes([f"{place} is read-only: results are written to the current folder"])
            return Path()
    return path.parent


def _is_folder(text: str) -> bool:
    """Return whether a path ends in a slash, or is a folder whose name has no known ending."""
    if text.endswith(("/", os.sep)):
        return True
    return bool(text) and Path(text).is_dir() and not text.lower().endswith(FORMATS.outputs)


def _check_outputs(
    inputs: Sequence[str], named: Sequence[Path], folders: Sequence[str], has_stream: bool
) -> None:
    for path in named:
        try:
            kit.known_ending(path, FORMATS.outputs)
        except ValueError as error:
            is_file = path.is_file() or path.suffix.lower() in FORMATS.meshes
            hint = "" if is_file or not path.name else f" (for a folder, write {path}/)"
            raise click.UsageError(f"{error}{hint}") from None
    if opts.STANDARD_STREAM in inputs and len(inputs) > 1:
        raise click.UsageError("standard input (-) must be the only input")
    if len(inputs) > 1 and (named or has_stream):
        name = named[0] if named else "-"
        raise click.UsageError(
            f"{name} is one file for {len(inputs)} inputs: give -o a folder, such as results/"
        )
    if len(folders) > 1:
        raise click.UsageError("give -o at most one folder")
    if folders and opts.STANDARD_STREAM in inputs:
        raise click.UsageError("standard input has no file name: give -o a file, not a folder")


def _check_stream(stream: str | None, *, is_text: bool) -> None:
    """Raise a usage error if a binary format, with the ending `stream`, would go to a terminal.

    Raises OSError if standard output is needed, but closed.
    """
    if stream is None:
        return
    if sys.stdout is None:
        raise OSError("standard output is closed")
    if stream not in TEXT_OUTPUTS and not is_text and sys.stdout.isatty():
        raise click.UsageError(
            "standard output is a terminal, which cannot show binary data: use -o FILE, or --to txt"
        )


def check_files(jobs: Sequence[Job], also_read: Iterable[Path | None]) -> None:
    """Raise a usage error if an output would overwrite an input or the output of another job."""
    names = [*(job.input for job in jobs), *(str(path) for path in also_read if path is not None)]
    read = {_identity(name): name for name in names if name != opts.STANDARD_STREAM}
    writers: dict[tuple[int, int] | str, Job] = {}
    for job in jobs:
        for path in job.files:
            identity = _identity(path)
            if identity in read:
                raise click.UsageError(f"{read[identity]}: the output would overwrite the input")
            other = writers.setdefault(identity, job)
            if other is not job:
                both = f"{other.input} and {job.input}"
                raise click.UsageError(f"{both} would both be written to {path}")


def _identity(path: str | Path) -> tuple[int, int] | str:
    """Return a key that is equal for all paths of the same file, including links."""
    try:
        found = Path(path).stat()
    except OSError:
        return os.path.normcase(os.path.realpath(path))
    return found.st_dev, found.st_ino
