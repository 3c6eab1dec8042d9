"""Export objects in the formats of COCO and ScanNet, as a table, as arrays, or as meshes."""

from __future__ import annotations

import json
import re
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from superfacets import kit, split_regions, vertex_labels, write_mesh
from superfacets.kit import Array, Bools, Ints, atomic_outputs, kind_of
from superfacets_scans import GROUPS, SEGMENTS, scene_of, write_groups, write_segments

from ..documents.document import Document
from ..labels.classes import INSTANCES, stuff_of

FORMATS = ("json", "npz", "csv", "aggregation.json", "segs.json", "zip")

FORMATS_OF_KIND = {
    **dict.fromkeys(("triangles", "polygons"), ("ply", "obj", "off", "glb", "vtp")),
    "tets": ("vtu", "vtk"),
    "points": ("ply", "csv", "las", "laz"),
}
"""Formats of meshes and clouds, the default first, for each kind of cells."""

PAIRED = {"aggregation.json": "segs.json", "segs.json": "aggregation.json"}
"""Two formats of ScanNet whose files belong together, each mapped to the other. One file contains
segments, and the other file contains objects as groups of these segments."""


@dataclass(frozen=True)
class Object:
    """An object, or all cells of a class that are in no object."""

    class_id: int
    object_id: int  # 0 means cells that are in no object
    label: str  # name of the class
    name: str  # name of the object
    is_stuff: bool  # whether the class has no objects, such as walls

    @property
    def instance(self) -> int:
        """Class and object as one number: ``class_id * 1000 + object_id``."""
        return self.class_id * INSTANCES + self.object_id


def objects_of(document: Document, instances: Ints) -> list[Object]:
    """Return an `Object` for each instance in an array except 0, in ascending order."""
    stuff = stuff_of(document.class_list)
    found = []
    for instance in np.setdiff1d(instances, 0).tolist():
        class_id, object_id = divmod(instance, INSTANCES)
        label, name = document.name_of(class_id), document.name_of(class_id, object_id)
        found.append(Object(class_id, object_id, label, name, class_id in stuff))
    return found


def vertex_instances(document: Document) -> Ints:
    """Return the instance (class and object) with the largest area around each vertex.

    The instance is 0 if unlabeled cells have the largest area, or if the vertex has no cells.
    """
    return np.maximum(vertex_labels(document.cells, document.instances, method="majority"), 0)


def write_objects(document: Document, formats: Sequence[str], paths: Sequence[Path]) -> None:
    """Write the objects to a file in each of the given `FORMATS`: all files, or none."""
    with atomic_outputs(paths) as temporaries:
        for format, temporary, path in zip(formats, temporaries, paths, strict=True):
            _WRITERS[format](document, temporary, path)


def _write_json(document: Document, temporary: Path, path: Path) -> None:
    """Write COCO categories and annotations; masks are run lengths of cells, not of pixels."""
    instances, cells = document.instances, document.cells
    image = {"id": 1, "file_name": document.path.name, "n_cells": document.n_cells}
    categories = [
        {"id": one["id"], "name": one["name"], "color": [*bytes.fromhex(one["color"][1:])],
         "isthing": int(not one.get("stuff", False))}
        for one in document.class_list
    ]  # fmt: skip
    centers = document.segmenter.surface.positions
    annotations = []
    for number, one in enumerate(objects_of(document, instances), 1):
        is_in = instances == one.instance
        low, high = centers[is_in].min(axis=0), centers[is_in].max(axis=0)
        annotations.append(
            {
                "id": number, "image_id": 1, "category_id": one.class_id, "object": one.object_id,
                "name": one.name, "iscrowd": int(not one.object_id and not one.is_stuff),
                "area": float(document.areas[is_in].sum()), "n_cells": int(is_in.sum()),
                "bbox": [*low.tolist(), *(high - low).tolist()],
                "segmentation": {"size": [cells.n_cells], "counts": _runs(is_in)},
            }
        )  # fmt: skip
    content = {"images": [image], "categories": categories, "annotations": annotations}
    content |= document.statistics
    temporary.write_text(json.dumps(content, separators=(",", ":")) + "\n", encoding="utf-8")


def _runs(is_in: Bools) -> list[int]:
    """Return the lengths of runs of False and True in turn; the first is 0 if True is first."""
    ends = np.flatnonzero(np.diff(is_in, prepend=False))
    return list(np.diff(ends, prepend=0, append=len(is_in)).tolist())


def _columns(document: Document) -> dict[str, Array]:
    state = document.state
    return {"region": document.revision.labels, "class": state.classes, "object": state.objects}


def _write_arrays(document: Document, temporary: Path, path: Path) -> None:
    instances = document.instances
    objects = objects_of(document, instances)
    arrays: dict[str, Array] = {
        **_columns(document), "instance": instances, "vertex_instance": vertex_instances(document),
        "instances": np.array([one.instance for one in objects], np.int32),
        "labels": np.array([one.label for one in objects], np.str_),
        "names": np.array([one.name for one in objects], np.str_),
    }  # fmt: skip
    with temporary.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _write_table(document: Document, temporary: Path, path: Path) -> None:
    columns = {"cell": np.arange(document.n_cells), **_columns(document)}
    with temporary.open("wb") as file:
        file.write(",".join(columns).encode("ascii") + b"\n")
        row = b",".join([b"%d"] * len(columns)) + b"\n"
        numbers = (column.tolist() for column in columns.values())
        file.writelines(row % values for values in zip(*numbers, strict=True))


def _segments(document: Document) -> tuple[Ints, Ints]:
    """Return the segment and the instance of each vertex.

    A segment is a region or, if the region has several instances, its part in one instance.
    """
    instances = vertex_instances(document)
    regions = vertex_labels(document.cells, document.revision.labels, method="majority")
    pairs = np.stack([regions, instances], axis=1)
    _, segments = np.unique(pairs, axis=0, return_inverse=True)
    return segments.ravel().astype(np.int32), instances


def _write_segments(document: Document, temporary: Path, path: Path) -> None:
    with temporary.open("wb") as file:
        write_segments(file, _segments(document)[0], scene_of(path, SEGMENTS))


def _write_groups(document: Document, temporary: Path, path: Path) -> None:
    segments, instances = _segments(document)
    groups = []
    for one in objects_of(document, instances):
        own = np.unique(segments[instances == one.instance]).tolist()
        groups.append({"segments": own, "label": one.label, "name": one.name})
    with temporary.open("wb") as file:
        segments_file = path.name.removesuffix(GROUPS) + SEGMENTS
        write_groups(file, groups, scene_of(path, GROUPS), segments_file)


def _write_meshes(document: Document, temporary: Path, path: Path) -> None:
    instances = document.instances
    objects = objects_of(document, instances)
    ending = kit.FORMATS.usual_output(kind_of(document.cells).name)
    ranks = np.searchsorted([one.instance for one in objects], instances)
    labels = np.where(instances > 0, ranks, -1).astype(np.int32)
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        parts = split_regions(document.cells, labels) if objects else ()
        for one, part in zip(objects, parts, strict=True):
            with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
                file = Path(folder, f"object{ending}")
                write_mesh(file, part.mesh)
                safe_name = re.sub(r"[^\w-]+", "-", one.name, flags=re.ASCII).strip("-")
                archive.write(file, f"{one.instance}-{safe_name}{ending}")


_WRITERS: dict[str, Callable[[Document, Path, Path], None]] = {
    "json": _write_json, "npz": _write_arrays, "csv": _write_table, "zip": _write_meshes,
    "aggregation.json": _write_groups, "segs.json": _write_segments,
}  # fmt: skip
