"""Find the input files of a batch, and choose the names of their results."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import ClassVar

from ..base.lazy import load
from ..files.atomic import StrPath
from ..files.formats import FORMATS

FOUND_ENDINGS = tuple(ending for ending in FORMATS.cells if ending not in (".csv", ".txt", ".npy"))
"""Endings of the files in a folder that are inputs of a batch. ``.csv``, ``.txt`` and ``.npy`` are
excluded, because most files with these endings are not point clouds."""

BASE = 150 << 20
"""Memory of a worker process after its imports, in bytes."""

PER_CELL = 200
"""Memory in bytes per cell for graph, weights, labels and temporary arrays, without the mesh. With
1.4 million faces in PLY, OFF and STL, workers used a third to a half of the estimate."""

PER_BYTE = 3
"""Memory in bytes per byte of the input file, for its content, the mesh, and the output."""

FILE_BYTES = {".stl": 50, ".ply": 18, ".obj": 30, ".off": 30, ".laz": 3, ".vtp": 6}
"""Minimum number of bytes per cell in a file, for each ending; 12 for all other endings."""


@dataclass(frozen=True)
class InputFile:
    """An input file. Commands use it to find files, and to name their results."""

    input: str  # path of the file, as given by the caller or found in a folder
    name: str  # path relative to the input folder, with forward slashes on all platforms

    MARK: ClassVar[str] = ".superfacets"
    """Marker in the names of results. Files with this marker in a folder are not inputs."""

    @staticmethod
    def find(inputs: StrPath | Iterable[StrPath]) -> list[InputFile]:
        """Return all files that the `inputs` of `batch` stand for, without duplicates.

        Links to folders are not followed. Empty lines of a list (``@LIST``) and lines that begin
        with ``#`` are ignored. Raises an OSError if a folder or a list cannot be read, or if no
        file is found. Raises a ValueError if no input is given, or if two files have the same
        relative path. Raises a MissingExtraError if a format needs a missing package.
        """
        given = [inputs] if isinstance(inputs, (str, os.PathLike)) else list(inputs)
        found: dict[str, InputFile] = {}
        for text in (os.fspath(path) for path in given):
            for source in _expanded(text):
                other = found.setdefault(source.name, source)
                if os.path.realpath(other.input) != os.path.realpath(source.input):
                    raise ValueError(
                        f"{other.input} and {source.input} would have the same result name,"
                        f" {source.name}: use their common folder or a quoted pattern as input, so"
                        " that results are in different subfolders"
                    )
        if not found:
            raise ValueError("inputs must contain at least one file, folder, pattern or list")
        FORMATS.check_readers({PurePosixPath(name).suffix.lower() for name in found})
        return list(found.values())

    @property
    def usual_ending(self) -> str:
        """Default ending of the result."""
        ending = PurePosixPath(self.name).suffix.lower()
        return FORMATS.usual_outputs.get(ending, FORMATS.usual_output("triangles"))

    def output_names(self, endings: Sequence[str]) -> tuple[str, ...]:
        """Return the names of the results, one per ending, or one with the default ending."""
        path = PurePosixPath(self.name)
        wanted = tuple(endings) or (self.usual_ending,)
        return tuple(str(path.with_name(_output_name(path, ending))) for ending in wanted)

    @staticmethod
    def check_outputs_differ(sources: Iterable[InputFile], endings: Sequence[str]) -> None:
        """Raise a ValueError if the results of two files would have the same path."""
        writers: dict[str, InputFile] = {}
        for source in sources:
            for output in source.output_names(endings):
                other = writers.setdefault(os.path.normcase(output), source)
                if other is not source:
                    raise ValueError(
                        f"the results of {other.input} and {source.input} would both be written to"
                        f" {output}: move one of the files to another folder"
                    )

    @property
    def most_cells(self) -> int:
        """Upper bound on the number of cells, from the file size; 0 if the file is missing."""
        return self._size // FILE_BYTES.get(Path(self.input).suffix.lower(), 12)

    @property
    def memory(self) -> int:
        """Memory, in bytes, that a process needs to segment the file; usually too high."""
        return BASE + PER_BYTE * self._size + PER_CELL * self.most_cells

    @property
    def _size(self) -> int:
        try:
            return Path(self.input).stat().st_size
        except OSError:
            return 0


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
            if (
                Path(name).suffix.lower() in FOUND_ENDINGS
                and InputFile.MARK not in Path(name).suffixes
            ):
                path = Path(parent, name)
                n_found += 1
                yield InputFile(str(path), path.relative_to(folder).as_posix())
    if not n_found:
        raise FileNotFoundError(f"{folder}: no file in it ends in {', '.join(FOUND_ENDINGS)}")


def _fail(error: OSError) -> None:
    raise error


def _matching(pattern: str) -> Iterator[InputFile]:
    """Yield all files of a pattern, relative to the folder before its first wildcard."""
    parts = Path(pattern).parts
    n_plain = next(place for place, part in enumerate(parts) if glob.has_magic(part))
    root = Path(*parts[:n_plain])
    wanted = str(Path(*parts[n_plain:]))
    found = sorted(path for path in root.glob(wanted) if path.is_file())
    if not found:
        raise FileNotFoundError(f"{pattern}: no file matches this pattern")
    for path in found:
        yield InputFile(str(path), path.relative_to(root).as_posix())


def _output_name(path: PurePosixPath, ending: str) -> str:
    """Return the name of a result, with `InputFile.MARK` unless the format prescribes names."""
    stem = FORMATS.stem_of(path)
    if ending == ".segs.json":
        return f"{stem}.0.010000{ending}"
    if ending in (".aggregation.json", ".bin", "_sp_label.npy", ".pth"):
        scene_of = load("superfacets_scans.scannet:scene_of")
        return f"{scene_of(Path(f'{stem}.ply'), '.ply')}{ending}"
    return f"{stem}{InputFile.MARK}{ending}"
