"""Damaged documents of labels, objects and cameras are read, or refused by one short line."""

from __future__ import annotations

import functools
import json
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import damage
import numpy as np
import shapes

import superfacets as sf
from superfacets_scans import group_segments, regroup_segments
from superfacets_studio.documents.document import Document
from superfacets_studio.labels.imports import ENDINGS, read_import

from .files import odd_document
from .promises import refusals, short_messages

GROUPS, SEGMENTS = ".aggregation.json", ".segs.json"

FRAME = {
    "file_path": "a.png", "w": 4, "h": 4, "fl_x": 10.0, "cx": 2.0, "cy": 2.0,
    "transform_matrix": np.eye(4).tolist(),
}  # fmt: skip

CAMERAS = {
    "transforms.json": json.dumps({"frames": [FRAME, {**FRAME, "file_path": "b.png"}]}),
    "model/cameras.txt": "1 PINHOLE 4 4 10 10 2 2\n",
    "model/images.txt": "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 0 0 0 1 b.png\n\n",
    "poses/a.txt": "1 0 0 2\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
}
"""Files of cameras. Files in one folder belong together."""


def check_documents(rng: np.random.Generator, folder: Path) -> None:
    """Change one file of a set of files that belong together, and read the set."""
    source = random.Random(int(rng.integers(2**63)))
    read, files = source.choice(_sets_of_files())
    name = source.choice(sorted(files))
    data = files[name]
    if name.endswith(".json") and source.random() < 0.6:
        data = json.dumps(odd_document(json.loads(data), source)).encode()
    if source.random() < 0.6:
        data = damage.damaged(data, source)
    for other, content in (files | {name: data}).items():
        path = folder / other
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    with refusals(), short_messages(folder, sf.MeshError, OSError):
        read(folder, files)


def _imported(folder: Path, files: dict[str, bytes]) -> None:
    """Import the files into the studio, and write the objects to a work file."""
    given = {name: (folder / name).read_bytes() for name in files if name != "cube.ply"}
    document = Document.open(folder / "cube.ply", n_segments=5)
    try:
        document.apply_import(read_import(given, document.cells, document.class_list))
    finally:
        document.close()


def _regrouped(folder: Path, files: dict[str, bytes]) -> None:
    groups, new = folder / f"cube{GROUPS}", folder / f"cube{SEGMENTS}"
    regroup_segments(folder / f"new{GROUPS}", groups, new, segments=new)
    n_segments = len(np.unique(sf.read_labels(new)))
    group_segments(folder / f"other{GROUPS}", new, np.arange(n_segments))


def _cameras_at(name: str) -> Callable[[Path, dict[str, bytes]], Any]:
    return lambda folder, files: sf.read_cameras(
        folder / name, intrinsics=(10, 10, 2, 2), size=(4, 4)
    )


@functools.cache
def _sets_of_files() -> list[tuple[Callable[[Path, dict[str, bytes]], Any], dict[str, bytes]]]:
    """Return pairs of a function that reads files, and the content of these files."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as text:
        folder = Path(text)
        mesh = shapes.bumpy_sheet(4)
        labels = np.arange(mesh.n_faces) * 5 // mesh.n_faces
        for ending in (".ply", SEGMENTS, GROUPS, ".sstk.json"):
            given = {"classes": list("abcde")} if ending == GROUPS else {}
            sf.write_mesh(folder / f"cube{ending}", mesh, labels, **given)
        sf.write_labels(folder / "cube.npy", labels)
        sf.write_labels(folder / "cube.seg", labels)
        content = {path.name: path.read_bytes() for path in folder.iterdir()}
    counts = [0, 3, mesh.n_faces - 3]
    objects = {
        "categories": [{"id": 1, "name": "a", "isthing": 1}],
        "annotations": [{"segmentation": {"counts": counts, "size": [mesh.n_faces, 1]},
                         "category_id": 1, "object": 2, "score": 0.5, "name": "b"}],
    }  # fmt: skip
    content["cube.objects.json"] = json.dumps(objects).encode()
    sets = [
        (_imported, {key: content[key] for key in ("cube.ply", f"cube{ending}")})
        for ending in ENDINGS
        if ending != GROUPS and f"cube{ending}" in content
    ]
    both = {key: content[key] for key in (f"cube{SEGMENTS}", f"cube{GROUPS}")}
    sets += [(_imported, {"cube.ply": content["cube.ply"], **both}), (_regrouped, both)]
    for place in ("transforms.json", "model", "poses"):
        files = {name: text.encode() for name, text in CAMERAS.items() if name.startswith(place)}
        sets.append((_cameras_at(place), files))
    return sets
