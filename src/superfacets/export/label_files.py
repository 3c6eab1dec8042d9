"""Write labels to one file, or to a separate file for each file of an input folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from .._types import Ints
from ..io.atomic import StrPath, atomic_outputs, checked_targets, writable_folder
from ..io.readers.pieces import Pieces, SourceFile, files_of, holds_files
from .scannet import write_array


def label_files(source: object, out: StrPath) -> list[Path]:
    """Return the paths of the output files for the labels of a source.

    `out` is the path of a ``.npy`` file or, if the source is a folder, also of a folder, which is
    created if it is missing. A path is treated as a folder if it ends in a slash, has no suffix, or
    is an existing folder with another suffix than ``.npy``. Raises a ValueError for any other
    `out`, if an output file is a file of the source, or if two files of the source would have the
    same output file. Raises an OSError if a file cannot be written.
    """
    if not _is_folder(out):
        if Path(out).suffix != ".npy":
            raise ValueError(f"out must end in .npy, got {Path(out).name!r}")
        files = [Path(out)]
    elif isinstance(source, (str, os.PathLike)) and holds_files(Path(source)):
        files = [Path(out, name) for name in label_names(Path(source))]
        writable_folder(Path(out))
    else:
        raise ValueError(
            f"out must end in .npy, got {os.fspath(out)!r}: out can be a folder only if the source"
            " is a folder"
        )
    checked_targets(files)
    if isinstance(source, (str, os.PathLike)) and Path(source).exists():
        inputs = {file.path.resolve() for file in files_of(Path(source))}
        for file in files:
            if file.resolve() in inputs:
                raise ValueError(
                    f"{file}: out must not be a file of the source: choose another file name"
                )
    return files


def _is_folder(out: StrPath) -> bool:
    text = os.fspath(out)
    if text.endswith(("/", os.sep)):
        return True
    suffix = Path(text).suffix
    return text != "" and (not suffix or (suffix != ".npy" and Path(text).is_dir()))


def label_names(folder: Path) -> list[str]:
    """Return the name of the label file for each file in a folder: ``a.npy`` for ``a.ply``.

    For a tileset, slashes in file names are replaced by ``_``. Raises a ValueError if two names are
    equal, and an OSError if the folder has neither meshes nor clouds.
    """
    found: dict[str, SourceFile] = {}
    names = []
    for file in files_of(folder):
        name = f"{file.name.removesuffix(file.path.suffix).replace('/', '_')}.npy"
        names.append(name)
        other = found.setdefault(os.path.normcase(name), file)
        if other is not file:
            raise ValueError(
                f"the labels of {other.name} and {file.name} in {folder} would both be written to"
                f" {name}: rename one of the two files, or write all labels to a single .npy file"
            )
    return names


def ranges_of(pieces: Pieces, n_files: int) -> tuple[int, ...]:
    """Return offsets that split the labels among the output files, shape (n_files + 1,).

    Raises an OSError if the number of files in the input folder is no longer `n_files`.
    """
    starts = pieces.starts
    if n_files <= 1:
        return starts[0], starts[-1]
    if len(starts) != n_files + 1:
        raise OSError(
            f"the folder had {n_files} files when the run began, but now has {len(starts) - 1}:"
            " run again"
        )
    return starts


def save_labels(files: Sequence[Path], starts: Sequence[int], labels: Ints) -> None:
    """Write consecutive ranges of labels to ``.npy`` files: either all files, or none.

    File i gets ``labels[starts[i]:starts[i + 1]]``.
    """
    with atomic_outputs(files) as temporaries:
        for temporary, file, (begin, end) in zip(temporaries, files, pairwise(starts), strict=True):
            try:
                write_array(temporary, labels[begin:end])
            except OSError as error:
                error.filename = str(file)
                raise
