"""Damaged files: read, or refused by a MeshError of one line that begins with the path."""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import damage
import mesh_files
import numpy as np

import superfacets as sf

from .promises import check_result, refusals

FILES_PER_CASE = 30
"""A damaged file is read in a millisecond."""

ODD_VALUES = (
    None, True, -1, 0, 1, 2**31, 2**63, 10**400, 0.5, -1e308, "", "\ud800", "../a",
    "%2Fetc%2Fhosts", "data:;base64,AAAA", [], {}, [0, 0], [[]], {"POSITION": 0},
)  # fmt: skip


def check_mesh_file(rng: np.random.Generator, folder: Path) -> None:
    """Damaged mesh files; what is read of them can be segmented."""
    source = random.Random(int(rng.integers(2**63)))
    for _ in range(FILES_PER_CASE):
        name, data = _mesh_file(source)
        path = folder / name
        if damage.check(sf.read_mesh, path, _damaged(data, source)):
            mesh = sf.read_mesh(path)
            with refusals():
                check_result(sf.segment(mesh, min(3, mesh.n_faces)), sf.build_face_graph(mesh))


def check_label_file(rng: np.random.Generator, folder: Path) -> None:
    """Damaged files of labels."""
    source = random.Random(int(rng.integers(2**63)))
    whole = sorted(damage.whole_label_files(folder).items())
    for _ in range(FILES_PER_CASE):
        name, data = source.choice(whole)
        name = name.replace(".seg", source.choice((".seg", ".txt")))
        damage.check(sf.read_labels, folder / name, _damaged(data, source))


def _mesh_file(source: random.Random) -> tuple[str, bytes]:
    """A file of any format, whole, or whole but for a value in its JSON."""
    if source.random() < 0.3:
        document = json.dumps(_odd_document(source)).encode()
        return ("a.gltf", document) if source.random() < 0.3 else ("a.glb", _glb(document))
    return source.choice(sorted(mesh_files.whole_files().items()))


def _glb(document: bytes) -> bytes:
    """A binary glTF file of this JSON, with the buffer that its accessors describe."""
    return mesh_files.glb(json.loads(document))


def _odd_document(source: random.Random) -> dict[str, Any]:
    """A glTF document with one to three of its values replaced, or doubled."""
    document: dict[str, Any] = mesh_files.gltf_document()
    for _ in range(source.choice((1, 1, 2, 3))):
        place: Any = document
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            key = source.choice(keys)
            if not isinstance(place[key], dict | list) or not place[key] or source.random() < 0.2:
                break
            place = place[key]
        if isinstance(place[key], list) and source.random() < 0.5:
            place[key] = place[key] * source.choice((2, 300))
        else:
            place[key] = copy.deepcopy(source.choice(ODD_VALUES))
            if not document:
                return document
    return document


def _damaged(data: bytes, source: random.Random) -> bytes:
    """The file, mostly with bytes changed, or cut, or as another of these begins."""
    kind = source.random()
    if kind < 0.1:
        return data
    if kind < 0.2:
        return data[: source.randrange(1, len(data) + 1)]
    if kind < 0.3:
        other = source.choice(sorted(mesh_files.whole_files().values()))
        return other[: source.randrange(1, len(other))] + data[source.randrange(len(data)) :]
    return damage.damaged(data, source)
