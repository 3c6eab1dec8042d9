"""Find the input files of a batch, and choose the names of their results."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ..base.lazy import load
from ..files.atomic import StrPath
from ..files.formats import CELL_ENDINGS, READERS, WRITERS
from ..files.writers.cells import usual_ending

FOUND_ENDINGS = tuple(ending for ending in CELL_ENDINGS if ending not in (".csv", ".txt", ".npy"))
"""Endings of the files in a folder that are inputs of a batch. ``.csv``, ``.txt`` and ``.npy`` are
excluded, because most files with these endings are not point clouds."""

MARK = ".superfacets"
"""Marker in the names of results. If a folder is searched, files with this marker are ignored."""


@dataclass(frozen=True)
class InputFile:
    """An input file of a batch."""

    input: str  # path of the file, as given by the caller or found in a folder
    name: str  # path relative to the input folder, with forward slashes on all platforms


def find_sources(inputs: StrPath | Iterable[StrPath]) -> list[InputFile]:
    """Return all files that the `inputs` of `batch` stand for, without duplicates.

    Links to folders are not followed. Empty lines of a list (``@LIST``) and lines that begin with
    ``#`` are ignored. Raises an OSError if a folder or a list cannot be read, or if no file is
    found. Raises a ValueError if no input is given, or if two files have the same relative path.
    """
    given = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
    found: dict[str, InputFile] = {}
    for text in (os.fspath(path) for path in given):
        for source in _expanded(text):
            other = found.setdefault(source.name, source)
            if os.path.realpath(other.input) != os.path.realpath(source.input):
                raise ValueError(
                    f"{other.input} and {source.input} would have the same result name,"
                    f" {source.name}: use their common folder or a quoted pattern as input, so that"
                    " results are in different subfolders"
                )
    if not found:
        raise ValueError("inputs must contain at least one file, folder, pattern or list")
    return list(found.values())


def _expanded(text: str) -> Iterator[InputFile]:
    path = Path(text)
    if not text:
        raise ValueError("inputs must not contain an empty path")
    if text.startswith("@"):
        yield from _listed(Path(text[1:]))
    elif glob.has_magic(text) and not path.exists():
        yield from _matching(text)
    elif path.is_dir():
        yield from _below(path)
    else:
        yield InputFile(text, path.name)


def _listed(path: Path) -> Iterator[InputFile]:
    for line in path.read_text(encoding="utf-8").splitlines():
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        name = os.path.normpath(text)
        is_below = not Path(name).is_absolute() and Path(name).parts[0] != os.pardir
        shown = Path(name if is_below else Path(name).name)
        yield InputFile(str(path.parent / text), shown.as_posix())


def _below(folder: Path) -> Iterator[InputFile]:
    """Yield the input files in a folder and its subfolders, sorted by path."""
    n_found = 0
    for parent, folders, names in os.walk(folder, onerror=_fail):
        folders.sort()
        for name in sorted(names):
            if Path(name).suffix.lower() in FOUND_ENDINGS and MARK not in Path(name).suffixes:
                path = Path(parent, name)
                n_found += 1
                yield InputFile(str(path), path.relative_to(folder).as_posix())
    if not n_found:
        raise FileNotFoundError(f"{folder}: no file in it ends in {', '.join(FOUND_ENDINGS)}")


def _fail(error: OSError) -> None:
    raise error


def _matching(pattern: str) -> Iterator[InputFile]:
    """Yield all files that match a pattern.

    Names are relative to the folder at the start of the pattern, before the first wildcard.
    """
    parts = Path(pattern).parts
    n_plain = next(place for place, part in enumerate(parts) if glob.has_magic(part))
    root = Path(*parts[:n_plain])
    wanted = str(Path(*parts[n_plain:]))
    found = sorted(path for path in root.glob(wanted) if path.is_file())
    if not found:
        raise FileNotFoundError(f"{pattern}: no file matches this pattern")
    for path in found:
        yield InputFile(str(path), path.relative_to(root).as_posix())


def result_ending(name: str) -> str:
    """Return the default ending of the result for an input file."""
    ending = PurePosixPath(name).suffix.lower()
    kinds = [kind for kind, table in READERS.items() if ending in table]
    of_one = kinds[0] if len(kinds) == 1 and kinds[0] != "points" else "triangles"
    return usual_ending(of_one if of_one in WRITERS else "triangles")


def output_names(name: str, endings: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the results for an input file, one name per ending.

    If `endings` is empty, there is one result, with the default ending.
    """
    path = PurePosixPath(name)
    wanted = tuple(endings) or (result_ending(name),)
    return tuple(str(path.with_name(_output_name(path, ending))) for ending in wanted)


def _output_name(path: PurePosixPath, ending: str) -> str:
    """Return the name of a result. It contains `MARK`, unless the format prescribes names."""
    if ending == ".segs.json":
        return f"{path.stem}.0.010000{ending}"
    if ending in (".aggregation.json", ".bin", "_sp_label.npy", ".pth"):
        scene_of = load("superfacets_scans.scannet:scene_of")
        return f"{scene_of(Path(path), path.suffix)}{ending}"
    return f"{path.stem}{MARK}{ending}"


def check_outputs_differ(sources: Iterable[InputFile], endings: Sequence[str]) -> None:
    """Raise a ValueError if the results of two files would have the same path."""
    writers: dict[str, InputFile] = {}
    for source in sources:
        for output in output_names(source.name, endings):
            other = writers.setdefault(os.path.normcase(output), source)
            if other is not source:
                raise ValueError(
                    f"the results of {other.input} and {source.input} would both be written to"
                    f" {output}: move one of the files to another folder"
                )
