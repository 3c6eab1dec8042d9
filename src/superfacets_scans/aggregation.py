"""Group segments into objects, as in ScanNet, and transfer objects to new segments."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets import MeshError, read_labels
from superfacets.kit import (
    Content,
    FormatOptions,
    Input,
    Ints,
    Longs,
    StrPath,
    atomic_outputs,
    checked_classes,
    counted,
    known_ending,
    named_errors,
    parsed_json,
    ranked_labels,
    read_content,
    weighted_majority,
)

from .scannet import (
    GROUPS,
    SEGMENTS,
    check_truth_stays,
    name_in_groups,
    scene_of,
    write_aggregation,
)


class RegroupedObject(NamedTuple):
    """Numbers of vertices that an object loses and gains in `regroup_segments`.

    Attributes
    ----------
    object_id : int
        Id of the object in the file.
    label : str
        Class of the object, or an empty string.
    n_vertices : int
        Number of vertices of the object with the old segments.
    n_lost : int
        Number of vertices that are in the object with the old, but not with the new segments.
    n_gained : int
        Number of vertices that are in the object with the new, but not with the old segments.
    """

    object_id: int
    label: str
    n_vertices: int
    n_lost: int
    n_gained: int


def group_segments(
    output: StrPath, segments: StrPath, objects: npt.ArrayLike, *,
    classes: Sequence[str] | Sequence[int] | None = None, scores: npt.ArrayLike | None = None,
    force: bool = False,
) -> None:  # fmt: skip
    """Write an ``.aggregation.json`` file, in which each object is a group of segments.

    Parameters
    ----------
    output : path-like
        New file ``.aggregation.json``. ``segmentsFile`` becomes ``scannet.`` plus the name of
        `segments`.
    segments : path-like
        File ``.segs.json`` with the segment of each vertex.
    objects : array_like of int, shape (K,)
        Object of each of the K segments, in ascending order of their ids, or -1 for no object.
        Numbers may have gaps. An example is ``lift(...).region_labels``. In files written by this
        package, each vertex without a face is a segment, with one of the highest ids.
    classes, scores, force
        Same as in `write_mesh`, with one class and one score per object, in ascending order.

    Raises
    ------
    MeshError
        If a file has another ending, if `segments` is damaged, or if the number of classes or
        scores is wrong.
    ValueError, TypeError
        If `objects` are not one integer >= -1 per segment, or if classes or scores are not valid.
    OSError
        If a file cannot be read or written. The error is a FileExistsError if `force` is needed.

    See Also
    --------
    regroup_segments : Transfers objects to other segments of the same mesh.

    Examples
    --------
    >>> import json
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from superfacets import write_labels
    >>> with TemporaryDirectory() as folder:
    ...     segments, output = Path(folder, "room.segs.json"), Path(folder, "room.aggregation.json")
    ...     write_labels(segments, [0, 0, 3, 4, 4])
    ...     group_segments(output, segments, [1, 1, -1])
    ...     [group["segments"] for group in json.loads(output.read_text())["segGroups"]]
    [[0, 3]]
    """
    for path, ending in ((segments, SEGMENTS), (output, GROUPS)):
        known_ending(path, (ending,))
    if not force:
        check_truth_stays([output])
    options = FormatOptions.checked([GROUPS], classes=classes, scores=scores)
    ids = ranked_labels(read_labels(segments))[1]
    of_segments = checked_classes(np.atleast_1d(objects), len(ids), "objects", "segment")
    options.check_classes(of_segments, "object")
    with atomic_outputs([output]) as (temporary,), temporary.open("wb") as file:
        write_aggregation(
            file, ids, of_segments, scene_of(Path(output), GROUPS), classes=options.classes,
            scores=options.scores, segments_file=name_in_groups(Path(segments)),
        )  # fmt: skip


def regroup_segments(
    output: StrPath, aggregation: StrPath, new_segments: StrPath, *,
    segments: StrPath | None = None, force: bool = False,
) -> list[RegroupedObject]:  # fmt: skip
    """Write an ``.aggregation.json`` file with the same objects, but with new segments.

    Each new segment is assigned to the object that contains the largest number of its vertices, or
    to no object if more of its vertices are in no object. Where a new segment crosses the border of
    an object, the border moves to the border of the segment.

    Parameters
    ----------
    output : path-like
        New file ``.aggregation.json``. ``segmentsFile`` becomes ``scannet.`` plus the name of
        `new_segments`, a missing ``sceneId`` is added, and objects without a segment are left out.
        All other data are copied from `aggregation`.
    aggregation : path-like
        File ``.aggregation.json`` with objects, which are groups of old segments.
    new_segments : path-like
        File ``.segs.json`` with the new segments.
    segments : path-like, optional
        File ``.segs.json`` with the old segments. By default, it is the ``segmentsFile`` of
        `aggregation`, with or without the prefix ``scannet.``, in the folder of `aggregation`.
    force : bool, default False
        Whether an existing `output` is overwritten. `aggregation` itself is never overwritten.

    Returns
    -------
    list of RegroupedObject
        Changes of the objects, in the order of `aggregation`.

    Raises
    ------
    MeshError
        If a file is damaged or has another ending, if the files belong to different meshes, or if
        the ``segmentsFile`` is not found.
    ValueError
        If `output` and `aggregation` are the same file.
    FileExistsError
        If `output` exists and `force` is False.
    OSError
        If a file cannot be read or written.

    Notes
    -----
    Time is O(V log V) for V vertices. If a segment is in several objects, the first object is used.
    """
    for path, ending in ((aggregation, GROUPS), (new_segments, SEGMENTS), (output, GROUPS)):
        known_ending(path, (ending,))
    if Path(output).resolve() == Path(aggregation).resolve():
        raise ValueError(f"{output}: output must differ from aggregation, which is never replaced")
    if not force:
        check_truth_stays([output])
    with named_errors(aggregation):
        groups = _Groups.of(read_content(Path(aggregation)))
        source = Path(segments or groups.named_segments(Path(aggregation).parent))
    known_ending(source, (SEGMENTS,))
    old, new = read_labels(source), read_labels(new_segments)
    if len(old) != len(new):
        raise MeshError(
            f"{new_segments}: must have {counted(len(old), 'vertex')} like {source}, got {len(new)}"
        )
    with named_errors(aggregation):
        before = groups.objects_of(old, source)
    ids, of_vertices = np.unique(new, return_inverse=True)
    votes = np.ones(len(before))
    of_segments = weighted_majority(of_vertices, before.astype(np.int32), votes, len(ids)).winners
    after = of_segments[of_vertices]
    groups.write(Path(output), ids, of_segments, Path(new_segments))
    return [
        RegroupedObject(
            int(entry["objectId"]), str(entry.get("label", "")), int((before == i).sum()),
            int(((before == i) & (after != i)).sum()), int(((before != i) & (after == i)).sum()),
        )
        for i, entry in enumerate(groups.entries)
    ]  # fmt: skip


@dataclass(frozen=True)
class _Groups:
    """Content of an ``.aggregation.json`` file."""

    document: dict[str, Any]  # the whole file
    entries: list[dict[str, Any]]  # the list "segGroups", with one entry per object

    @classmethod
    def of(cls, data: Content) -> _Groups:
        document = parsed_json(bytes(data), "the file")
        entries = document.get("segGroups") if isinstance(document, dict) else None
        if not isinstance(entries, list) or not all(map(_is_group, entries)):
            raise MeshError("must have a list segGroups, whose entries have objectId and segments")
        return cls(document, entries)

    def named_segments(self, folder: Path) -> Path:
        """Return the path of the ``segmentsFile``, which must be in the folder of the groups."""
        name = self.document.get("segmentsFile")
        if not isinstance(name, str) or not name:
            raise MeshError(
                "has no segmentsFile: add this entry, or give the path of the file of old segments"
                " (segments=)"
            )
        for text in (name, name.removeprefix("scannet.")):
            path = folder / Path(text).name
            if path.exists():
                return path
        raise MeshError(
            f"the segmentsFile {name} is not in the same folder: copy it there, or give its path"
            " (segments=)"
        )

    def objects_of(self, segments: Ints, source: Path) -> Longs:
        """Return the object of each vertex, or -1; raise a MeshError if a segment is missing."""
        ids, of_vertices = np.unique(segments, return_inverse=True)
        objects = np.full(len(ids), -1, np.int64)
        for i in range(len(self.entries) - 1, -1, -1):
            wanted = np.array(self.entries[i]["segments"], np.int64)
            at = np.minimum(np.searchsorted(ids, wanted), len(ids) - 1)
            is_missing = ids[at] != wanted
            if is_missing.any():
                raise MeshError(
                    f"has segment {wanted[np.argmax(is_missing)]}, which is not in {source.name}:"
                    " use the files of the same mesh"
                )
            objects[at] = i
        return objects[of_vertices]

    def write(self, path: Path, ids: Ints, of_segments: Ints, segments: Path) -> None:
        """Write the objects with new segments `ids`; `of_segments` are their objects, or -1."""
        entries = []
        for i, entry in enumerate(self.entries):
            own = ids[of_segments == i].tolist()
            if own:
                entries.append({**entry, "segments": own})
        name = name_in_groups(segments)
        document = {**self.document, "segGroups": entries, "segmentsFile": name}
        if "sceneId" not in document:
            document["sceneId"] = f"scannet.{scene_of(path, GROUPS)}"
        with atomic_outputs([path]) as (temporary,):
            temporary.write_text(json.dumps(document, separators=(",", ":")), encoding="ascii")


def objects_of_vertices(source: Input) -> Longs:
    """Return the ``objectId`` of each vertex in the content of an ``.aggregation.json``, or -1."""
    groups = _Groups.of(source.data)
    segments = groups.named_segments(source.folder or Path())
    known_ending(segments, (SEGMENTS,))
    ids = np.array([*(entry["objectId"] for entry in groups.entries), -1], np.int64)
    return ids[groups.objects_of(read_labels(segments), segments)]


def _is_group(entry: object) -> bool:
    if not isinstance(entry, dict) or not isinstance(entry.get("segments"), list):
        return False
    numbers = [entry.get("objectId"), *entry["segments"]]
    return all(type(number) is int and 0 <= number < 2**62 for number in numbers)
