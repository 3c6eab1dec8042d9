"""Write the classes of cells, vertices or regions, the objects, or the regions to a file."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import MeshAttributes, kit, vertex_labels, write_labels, write_mesh
from superfacets.kit import Bytes, Floats, Ints
from superfacets_scans import NO_CLASS

from ..documents.document import Document, work_file_of
from ..documents.files import Files
from ..labels.classes import names_of
from ..regions.revisions import Revision
from .objects import FORMATS, FORMATS_OF_KIND, PAIRED, vertex_instances, write_objects

_LISTS = ("npy", "seg", "txt")
LABELED = "labels.ply"
"""Format of ScanNet: a mesh with the class and the color of the class of each vertex."""

_NAMED = ("glb", "obj")  # formats that store a class per label
_COLORED = ("ply", "off", "glb", "vtp", "las", "laz")
_TEXTURED = (".obj", ".glb")

MARKS = {
    "cells": ".classes", "vertices": ".vertex-classes", "instances": ".instances",
    "objects": ".objects", "region_classes": ".region-classes",
}  # fmt: skip
"""Marker before the file ending, for each kind of export except regions (`InputFile.MARK`)."""


def formats_of(kind: str) -> dict[str, list[str]]:
    """Return the available formats of each kind of export, for a kind of cells."""
    of_triangles = ("sstk.json",) if kind == "triangles" else ()
    of_vertices = ("segs.json", "bin", "sp_label.npy")
    of_faces = (LABELED,) if kind in ("triangles", "polygons") else ()
    regions = (*_LISTS, *FORMATS_OF_KIND[kind], *of_vertices, *of_triangles, "npz")
    return {
        "cells": [*_LISTS, *FORMATS_OF_KIND[kind], *of_triangles], "objects": list(FORMATS),
        "vertices": [*_LISTS, "segs.json", *of_faces], "instances": ["txt", "npy"],
        "regions": list(regions), "region_classes": ["csv", "json", "npy"],
    }  # fmt: skip


def names_of_exports(document: Document) -> dict[str, dict[str, str]]:
    """Return the file name of each kind of export, for each of its formats.

    Names begin with the name of the work file without ``.studio.jsonl``, and without the ending of
    the input if that is the rest: ``room`` for ``room.ply.studio.jsonl`` in any folder.
    """
    return {
        what: {format: _name_of(document, what, format) for format in formats}
        for what, formats in formats_of(document.source.kind).items()
    }


def parsed_export(name: str) -> tuple[str, str | None]:
    """Return the kind and the format of an export like "objects.json"; the format may be missing.

    A name is the end of the default file names: marker and format. Raises ValueError if there is no
    such kind of export.
    """
    kinds = {mark[1:]: what for what, mark in {**MARKS, "regions": kit.InputFile.MARK}.items()}
    kind, _, format = name.partition(".")
    return kinds[kit.checked_choice(kind, "--export", tuple(kinds))], format or None


def write_exports(
    files: Files, index: int, wanted: Sequence[tuple[str, str | None]],
    targets: Sequence[tuple[int, Path]],
) -> tuple[list[Path], list[str]]:  # fmt: skip
    """Write exports of a file beside its target; return the paths, and notes for the user.

    `targets` are the result of `Files.targets`; `index` selects one of them. If nothing is labeled,
    only regions are exported. Raises a FileExistsError if files have the same exports.
    """
    number, target = targets[index]
    path = files.path(number)
    if [each for _, each in targets].count(target) > 1:
        raise FileExistsError(
            f"{path}: inputs that differ only in the ending have the same exports: export one input"
            " at a time, each to another folder with -o"
        )
    with contextlib.closing(files.read(number)) as document:
        notes = list(document.notes)
        kept = [one for one in wanted if document.progress or one[0] == "regions"]
        if len(kept) < len(wanted):
            notes.append(f"{path}: no labels are exported, because nothing is labeled")
        with kit.output_folder(target.parent):
            written = [write_export(document, *one, folder=target.parent) for one in kept]
    return written, notes


def write_export(
    document: Document, what: str, format: str | None, *, folder: Path | None = None,
    replace: bool = False,
) -> Path:  # fmt: skip
    """Write an export to a folder, by default the folder of the work file; return its path.

    If `format` is None, the first of the formats in `formats_of` is used.

    An existing file is replaced if its name contains a marker of the studio. Some names have no
    marker, because other tools require these names. An existing file with such a name may come from
    another tool, so it is replaced only if `replace` is True. Raises ValueError if `what` or
    `format` is unknown, or if the format cannot store the labels. Raises FileExistsError if the
    file exists and must not be replaced, and OSError if it cannot be written.
    """
    format = format or formats_of(document.source.kind)[what][0]
    path = (folder or document.journal.path.parent) / _name_of(document, what, format)
    is_ours = any(mark in path.name for mark in (kit.InputFile.MARK, *MARKS.values()))
    if path.exists() and not is_ours and not replace:
        raise FileExistsError(f"{path.name} exists already, and may come from another tool")
    kit.checked_targets([path])
    _write(document, what, format, path.parent)
    return path


def export_bytes(document: Document, what: str, format: str) -> tuple[str, bytes]:
    """Return name and content of the file of `write_export`, or of a .zip file with both files."""
    with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
        first, *others = _write(document, what, format, Path(folder))
        if not others:
            return first.name, first.read_bytes()
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in (first, *others):
                archive.write(path, path.name)
    return f"{_stem_of(document)}{MARKS[what]}.scannet.zip", packed.getvalue()


def class_of_regions(document: Document, revision: Revision) -> tuple[Ints, Floats]:
    """Return the class with the largest area in each region, and its fraction of the region's area.

    Unlabeled cells count as class 0. The fraction is 1 if the region has no area.
    """
    classes = document.state.classes.astype(np.int32)
    areas, labels, n = document.areas, revision.labels, revision.n_regions
    winners = kit.weighted_majority(labels, classes, areas, n).winners
    totals = kit.sums_by_label(labels, areas, n)
    won = kit.sums_by_label(labels, np.where(classes == winners[labels], areas, 0.0), n)
    return winners, np.divide(won, totals, out=np.ones(n), where=totals > 0)


def _name_of(document: Document, what: str, format: str) -> str:
    offered = formats_of(document.source.kind)
    kit.checked_choice(what, "what", tuple(offered))
    kit.checked_choice(format, "format", tuple(offered[what]))
    ending = kit.FORMATS.ending_of.get(format, f".{format}")
    stem = _stem_of(document)
    if what == "regions":
        return kit.InputFile("", f"{stem}.ply").output_names((ending,))[0]
    return f"{stem}.{format}" if format == LABELED else f"{stem}{MARKS[what]}{ending}"


def _stem_of(document: Document) -> str:
    """Return the stem of export names, which comes from the name of the work file."""
    work, usual = document.journal.path, kit.FORMATS.stem_of(document.path)
    if work.name == work_file_of(document.path).name:
        return usual
    stem = work.name.removesuffix(".jsonl").removesuffix(".studio")
    return f"{stem}.studio" if stem == usual else stem


def _write(document: Document, what: str, format: str, folder: Path) -> list[Path]:
    """Write the file of an export, and its second file if the format consists of two files."""
    pair = (format, PAIRED[format]) if what == "objects" and format in PAIRED else (format,)
    paths = [folder / _name_of(document, what, one) for one in pair]
    with document.lock:  # so that labels and names are from the same state
        if what == "objects":
            write_objects(document, pair, paths)
        else:
            _WRITERS[what](document, format, paths[0])
    return paths


def _write_cells(document: Document, format: str, path: Path) -> None:
    classes = document.state.classes.astype(np.int32)
    if format in (*_LISTS, "sstk.json"):
        write_labels(path, classes)
        return
    is_named = path.suffix in kit.FORMATS.class_outputs
    names = _names_of(document, np.unique(classes)) if is_named else None
    attributes = _attributes_for(document, path)
    is_textured = attributes is not None and attributes.texture is not None
    is_colored = format in _COLORED and not is_textured  # viewers multiply colors with the texture
    colors = _colors_of(document)[classes] if is_colored else None
    write_mesh(path, document.cells, classes, colors=colors, classes=names, attributes=attributes)


def _attributes_for(document: Document, path: Path) -> MeshAttributes | None:
    """Return attributes with the texture if the format can store it, and otherwise None.

    A .glb file contains the images. An .obj file refers to the images in the folder of the input,
    so an .obj file in another folder gets no texture.
    """
    is_alone = path.parent != document.path.parent
    if path.suffix not in _TEXTURED or (is_alone and path.suffix != ".glb"):
        return None
    return MeshAttributes(texture=document.source.texture)


def _write_vertices(document: Document, format: str, path: Path) -> None:
    classes = document.state.classes.astype(np.int32)
    labels = np.maximum(vertex_labels(document.cells, classes, method="majority"), 0)
    if format != LABELED:  # vertices without cells get class 0
        write_labels(path, labels)
        return
    shades = dict(zip(("red", "green", "blue"), _colors_of(document)[labels].T, strict=True))
    of_vertices = {**shades, "label": labels.astype(np.uint16)}
    write_mesh(path, document.cells, attributes=MeshAttributes(vertex=of_vertices))


def _write_regions(document: Document, format: str, path: Path) -> None:
    revision = document.revision
    if format in _LISTS:
        write_labels(path, revision.labels)
        return
    attributes = _attributes_for(document, path)
    names = None
    if format == "glb":  # OBJ could name groups by class only instead of by region
        names = _names_of(document, class_of_regions(document, revision)[0])
    write_mesh(path, document.cells, revision.labels, classes=names, attributes=attributes)


def _write_region_classes(document: Document, format: str, path: Path) -> None:
    revision = document.revision
    classes, shares = class_of_regions(document, revision)
    if format == "npy":
        write_labels(path, classes)
        return
    columns: dict[str, list[Any]] = {
        "region": list(range(revision.n_regions)), "class": classes.tolist(),
        "name": _names_of(document, classes), "share": shares.tolist(),
        "area": kit.sums_by_label(revision.labels, document.areas, revision.n_regions).tolist(),
        "cell_count": np.bincount(revision.labels).tolist(),
    }  # fmt: skip
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    with kit.atomic_outputs([path]) as (temporary,):
        if format == "json":
            temporary.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
            return
        with temporary.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, list(columns), lineterminator="\n")
            table.writeheader()
            table.writerows(rows)


_WRITERS: dict[str, Callable[[Document, str, Path], None]] = {
    "cells": _write_cells, "vertices": _write_vertices, "regions": _write_regions,
    "instances": lambda document, _, path: write_labels(path, vertex_instances(document)),
    "region_classes": _write_region_classes,
}  # fmt: skip


def _names_of(document: Document, classes: Ints) -> list[str]:
    names = names_of(document.class_list)
    return [names.get(class_id, NO_CLASS) for class_id in classes.tolist()]


def _colors_of(document: Document) -> Bytes:
    table = np.full((int(document.state.classes.max()) + 1, 3), 190, np.uint8)  # gray
    for entry in document.class_list:
        if entry["id"] < len(table):
            table[entry["id"]] = list(bytes.fromhex(entry["color"][1:]))
    return table
