"""Write labels for tools and networks of indoor scans: ScanNet, SSTK, OneFormer3D and UniDet3D."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from superfacets import MeshError
from superfacets.kit import Cells, Content, Ints, Longs, StrPath, kind_of, open_regular, parsed_json

MAX_ID = 1 << 24
"""Exclusive upper bound of ids. Some readers store ids as float32, which is exact up to 2**24."""

NO_CLASS = "unknown"
"""Label of groups without a class; ScanNet's labeling tool uses the same label."""

SEGMENTS = ".segs.json"
GROUPS = ".aggregation.json"

APP_ID = "superfacets"
"""Value of ``appId`` or ``software`` in files written by this package."""

AT_ONCE = 1 << 16
"""Number of integers of a list that are converted to text at a time."""

_MESH_NAME = re.compile(r"_vh_clean(_2)?([._]|$)")
"""Pattern of the suffix that ScanNet appends to the scene name in the names of mesh files."""

_THRESHOLD = re.compile(r"\.\d+\.\d+$")
"""Pattern of the threshold in the names of ScanNet's segment files, for example ``.0.010000``."""


def scene_of(path: Path | None, ending: str) -> str:
    """Return the name of the scene in a file name: the part before ``_vh_clean_2``, or the stem."""
    if path is None:
        return "scene"
    stem = _THRESHOLD.sub("", path.name[: -len(ending)])
    found = _MESH_NAME.search(stem)
    return stem[: found.start()] if found and found.start() else stem


def read_json(path: Path) -> Any:
    """Parse a JSON file; raise a MeshError that names the file if it is not valid."""
    with open_regular(path) as file:
        return parsed_json(file.read(), f"{path}:")


def check_truth_stays(paths: Iterable[StrPath]) -> None:
    """Raise a FileExistsError if writing to `paths` would destroy ground truth.

    Two kinds of files are ground truth. The first is an ``.aggregation.json`` or ``.segs.json``
    file from another program. The second is any ``.segs.json`` file whose segments are grouped by
    an ``.aggregation.json`` file that is in the same folder, but not in `paths`. New segments would
    make these groups invalid. The groups belong to the segments if the entry ``segmentsFile`` names
    the ``.segs.json`` file, or if both files have the same scene name.
    """
    outputs = [Path(path) for path in paths]
    for path in outputs:
        if not (path.name.endswith((GROUPS, SEGMENTS)) and path.exists()):
            continue
        are_segments = path.name.endswith(SEGMENTS)
        for groups in sorted(path.parent.glob(f"*{GROUPS}") if are_segments else ()):
            if groups not in outputs and path.name in _segment_files_of(groups, path):
                raise FileExistsError(
                    f"{path}: {groups.name} refers to the segments in this file, and would become"
                    " invalid: write to another folder, or overwrite the file (force=True, --force)"
                )
        if not _is_ours(path):
            raise FileExistsError(
                f"{path}: this file was written by another program, and its"
                f" {'segments' if are_segments else 'objects'} would be lost: write to another"
                " folder, or overwrite the file (force=True, --force)"
            )


def _is_ours(path: Path) -> bool:
    """Return whether this package wrote an ``.aggregation.json`` or ``.segs.json`` file."""
    try:
        found = json.loads(path.read_bytes())
        return bool(found.get("appId") == APP_ID or found["params"]["software"] == APP_ID)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return False


def _segment_files_of(groups: Path, segments: Path) -> set[str]:
    """Return the names of segment files to which an ``.aggregation.json`` file may refer."""
    names = set()
    if scene_of(groups, GROUPS) == scene_of(segments, SEGMENTS):
        names.add(segments.name)
    try:
        named = json.loads(groups.read_bytes())["segmentsFile"]
        names |= {named, named.removeprefix("scannet.")}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass  # if the file cannot be read, only its scene name identifies the segment file
    return names


def read_segments(data: Content) -> Longs:
    """Return the id of each vertex in a ``.segs.json`` file."""
    document = parsed_json(bytes(data), "the file")
    values = document.get("segIndices") if isinstance(document, dict) else None
    try:
        array = np.asarray(values if isinstance(values, list) else None)
    except ValueError:  # lists of different lengths
        array = np.empty(0)
    if array.ndim != 1 or array.dtype.kind != "i" or not len(array) or array.min() < 0:
        raise MeshError("must have segIndices, a list of integers >= 0")
    return array


def write_segments(file: IO[bytes], ids: npt.NDArray[np.integer], scene: str) -> None:
    """Write the segment id of each vertex as a ``.segs.json`` file."""
    check_ids(ids)
    params = f'{{"params":{{"software":"{APP_ID}","nSegments":{len(np.unique(ids))}}},"sceneId":'
    file.write(f'{params}{json.dumps(scene)},"segIndices":'.encode("ascii"))
    _write_list(file, ids)
    file.write(b"}")


def write_aggregation(
    file: IO[bytes], segments: npt.NDArray[np.integer], objects: npt.NDArray[np.integer],
    scene: str, *, classes: Sequence[str] | None = None, scores: Sequence[float] | None = None,
    segments_file: str | None = None,
) -> None:  # fmt: skip
    """Write an ``.aggregation.json`` file with one group of segments per object.

    `segments` are ids in ascending order, and `objects` is the object of each segment, or -1 for
    no object. Classes and scores are in ascending order of objects.
    """
    check_ids(segments)
    order = np.argsort(objects, kind="stable")
    order = order[np.searchsorted(objects[order], 0) :]
    starts = np.flatnonzero(np.diff(objects[order])) + 1
    members = [each.tolist() for each in np.split(segments[order], starts)] if len(order) else []
    names = [NO_CLASS] * len(members) if classes is None else classes
    groups: list[dict[str, Any]] = [
        {"segments": own, "label": name} for own, name in zip(members, names, strict=True)
    ]
    for group, score in zip(groups, scores or (), strict=False):
        group["score"] = round(score, 6)
    write_groups(file, groups, scene, segments_file)


def name_in_groups(segments: Path) -> str:
    """Return the ``segmentsFile`` of groups of the segments in a file, with ScanNet's prefix."""
    return f"scannet.{segments.name}"


def write_groups(
    file: IO[bytes], groups: Sequence[dict[str, Any]], scene: str, segments_file: str | None = None
) -> None:
    """Write groups of segments as an ``.aggregation.json`` file.

    Each group has the entries ``segments`` and ``label``, and may have other entries.
    `segments_file` is the name of the segment file; the default is ScanNet's name for the scene.
    If some groups have a class, groups without one are left out, because readers of ScanNet know
    only names of classes.
    """
    named = [group for group in groups if group["label"] not in ("", NO_CLASS)]
    groups = named or groups
    document = {
        "sceneId": f"scannet.{scene}",
        "appId": APP_ID,
        "segGroups": [{"id": i, "objectId": i, **group} for i, group in enumerate(groups)],
        "segmentsFile": segments_file or f"scannet.{scene}_vh_clean_2.0.010000.segs.json",
    }
    file.write(json.dumps(document, separators=(",", ":")).encode("ascii"))


def check_ids(ids: npt.NDArray[np.integer]) -> None:
    """Raise a MeshError if an id is 2**24 or more."""
    highest = int(ids.max(initial=0))
    if highest >= MAX_ID:
        raise MeshError(f"labels must be below 2**24 in this format, got {highest}: renumber them")


def check_triangles(cells: Cells) -> None:
    """Raise a MeshError unless the cells are triangles, because SSTK labels only triangles."""
    kind = kind_of(cells)
    if kind.name == "polygons":
        raise MeshError(
            ".sstk.json needs labels of triangles, not polygons: segment the result of"
            " PolygonMesh.triangulate()"
        )
    if kind.name != "triangles":
        raise MeshError(f".sstk.json needs labels of triangles, but the cells are {kind.noun}s")


def check_nested(levels: Sequence[Ints]) -> None:
    """Raise a MeshError if a region overlaps several regions of the next coarser level."""
    for level, (fine, coarse) in enumerate(pairwise(levels)):
        _, firsts, places = np.unique(fine, return_index=True, return_inverse=True)
        is_other = coarse != coarse[firsts[places]]
        if is_other.any():
            region = int(fine[np.argmax(is_other)])
            raise MeshError(
                f"levels are not nested: region {region} of level {level} is in several regions of"
                f" level {level + 1}"
            )


def write_sstk(file: IO[bytes], levels: Sequence[npt.NDArray[np.integer]]) -> None:
    """Write the region of each triangle, or -1, in levels from fine to coarse, for SSTK."""
    file.write(b'{"elementType":"triangles","elementCount":%d,"segmentation":[' % len(levels[0]))
    for level, labels in enumerate(levels):
        file.write(b"," if level else b"")
        file.write(b'{"name":"level%d","elementType":"triangles","index":' % level)
        _write_list(file, labels)
        file.write(b"}")
    names = ",".join(f'"level{level}"' for level in range(len(levels)))
    file.write(f'],"hierarchies":[{{"levels":[{names}]}}]}}'.encode("ascii"))


def write_superpoints(file: IO[bytes], ids: npt.NDArray[np.integer], ending: str) -> None:
    """Write one id per vertex for OneFormer3D (``.bin``) or UniDet3D (``_sp_label.npy``).

    Ids are renumbered from 0 without gaps, in ascending order, and written as little-endian 64-bit
    integers. A ``.bin`` file has no header.
    """
    numbers = _without_gaps(ids)
    if ending == ".bin":
        file.write(numbers.data)
    else:
        array = io.BytesIO()  # `numpy.save` calls ``tell``, which fails on pipes
        np.save(array, numbers)
        file.write(array.getbuffer())


def write_tensor(file: IO[bytes], ids: npt.NDArray[np.integer]) -> None:
    """Write ids of vertices, renumbered without gaps, as an int64 tensor for ISBNet, Open3DIS."""
    import torch

    torch.save(torch.from_numpy(_without_gaps(ids)), file)


def _write_list(file: IO[bytes], numbers: npt.NDArray[np.integer]) -> None:
    """Write integers as a JSON list, without spaces, many integers at a time."""
    file.write(b"[")
    for begin in range(0, len(numbers), AT_ONCE):
        texts = map(str, numbers[begin : begin + AT_ONCE].tolist())
        file.write(b"," * (begin > 0) + ",".join(texts).encode("ascii"))
    file.write(b"]")


def _without_gaps(ids: npt.NDArray[np.integer]) -> Longs:
    _, contiguous = np.unique(ids, return_inverse=True)
    numbers: Longs = contiguous.astype("<i8")
    return numbers
