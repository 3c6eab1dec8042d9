"""Define the operations on documents; the server has one route for each operation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast
from urllib.parse import quote

import numpy as np
from starlette.responses import Response

from superfacets import MeshError, View, cut_borders
from superfacets.kit import FORMATS, as_mesh, checked_choice, checked_flag, counted, kind_of
from superfacets_show import MOST_CUT, PALETTE, color_parts, shape_of, texture_parts

from ..documents.agreement import Side
from ..documents.changes import Change
from ..documents.document import Document
from ..export.write import export_bytes, names_of_exports, write_export
from ..labels.classes import checked_object
from ..labels.coding import base64_of, bytes_from, cells_from, packet, unpack_cells
from ..labels.imports import read_import
from ..regions.revisions import Revision, similar_regions
from ..regions.segmenting import levels_of, ranges
from .messages import BYTES, Body

Operation = Callable[[Document, Body], Any]
"""Function of a document and of the query or JSON object in a request. The document is locked while
the function runs, so that operations on one document never overlap. The reply to a POST request is
the result and `progress_of` the document."""

MAX_DIGITS = 20  # maximum length of a revision number in a query
MAX_STROKE = 64  # maximum length of the name of a stroke


def _state(document: Document, query: Body) -> Body:
    """Return the state of a document for the client, without arrays."""
    parameters, kind = document.state.partition.parameters, document.source.kind
    return {
        "parameters": parameters, "ranges": ranges(document.n_cells),
        "has_colors": document.source.color_features is not None,
        **regions_of(document.revision), "classes": list(document.class_list),
        "levels": levels_of(parameters["n_segments"]), "exports": names_of_exports(document),
        "input": document.source.facts["file"] | {"n_cells": document.n_cells, "kind": kind},
        "work": str(document.journal.path.resolve()), **progress_of(document),
        "notes": [*document.notes, *document.base.notes],
    }  # fmt: skip


def regions_of(revision: Revision) -> Body:
    """Return the number of a revision, and how many regions it has."""
    return {"revision": revision.number, "n_regions": revision.n_regions}


def progress_of(document: Document) -> Body:
    """Return the part of the state that the reply to every POST request contains."""
    with document.lock:
        state, history = document.state, document.history
        return {
            "seq": history.seq, "progress": document.progress, **document.statistics,
            "can_undo": bool(history.undo_stack), "can_redo": bool(history.redo_stack),
            "object_names": list(state.object_names), "n_suggestions": len(state.suggestions),
            "is_reviewed": state.is_reviewed, "is_changed": state.is_changed,
        }  # fmt: skip


def _effect(document: Document, changes: list[Change]) -> Body:
    """Return the changed cells of a step, with their new class and object.

    If the step changes only labels, ``kind`` is "paint". Otherwise it is the kind of another change
    in the step, and the client then requests the whole state.
    """
    kinds = [change.kind for change in changes if change.kind != "paint"]
    cells = np.unique(np.concatenate([change.cells(document.n_cells) for change in changes]))
    return {
        "kind": kinds[0] if kinds else "paint",
        "cells": base64_of(cells.astype(np.uint32)),
        "paint": base64_of(document.state.paint[cells]),
    }


def _mesh_packet(document: Document, query: Body) -> bytes:
    """Return the geometry of the mesh in the binary format of `packet`.

    Positions are float32, relative to the center of the bounding box. Vertices with equal positions
    are merged, and sorted by their first use in a triangle. For polygons and tetrahedra, the array
    ``sources`` contains the cell that each triangle belongs to, in ascending order. For point
    clouds, ``normals`` contains packed normals, which are estimates if ``has_normals`` is false. If
    the file has colors, and no texture that can be shown, the arrays of `color_parts` are added.
    """
    shape = shape_of(document.cells, document.segmenter.build().result()[0])
    center = document.cells.bounds.mean(axis=0)
    is_z_up = document.source.path.suffix.lower() in FORMATS.z_up and document.up == "auto"
    header = {
        "kind": document.source.kind, "n_cells": document.n_cells, "center": center.tolist(),
        "measure": "volume" if kind_of(document.cells).dimension == 3 else "area",
        "has_normals": kind_of(document.cells).has_fronts(document.cells),
        **shape.view_facts(View(up="z" if is_z_up else document.up)),
        "low": [0, 0, 0], "step": [1, 1, 1], "point_size": shape.point_size * shape.diagonal,
        "palette": PALETTE.tolist(), "texture": None, "texture_problem": "",
    }  # fmt: skip
    arrays: dict[str, Any] = {"areas": document.areas.astype(np.float32)}
    if document.source.texture is not None:
        try:
            header["texture"], parts = texture_parts(
                as_mesh(document.cells), document.source.texture
            )
            arrays |= {name: array for name, (array, _) in parts.items()}
        except (MeshError, ImportError) as error:
            header["texture_problem"] = str(error)
    if header["texture"] is None and document.source.colors is not None:
        parts = color_parts(document.cells, shape, document.source.colors)
        arrays |= {name: array for name, (array, _) in parts.items()}
    for name, (array, _) in shape.parts((shape.points - center).astype(np.float32)).items():
        arrays[name] = array
    return packet(header, arrays)


def _region_packet(document: Document, query: Body) -> bytes:
    """Return all pairs of adjacent regions, uint32, (A, 2), in the binary format of `packet`."""
    revision = document.revisions.get(_number(query))
    graph = revision.graph(document.segmenter.surface)
    header = {"revision": revision.number, "n_regions": revision.n_regions}
    return packet(header, {"arcs": graph.edge_index.T.astype(np.uint32)})


def border_packet(document: Document, query: Body) -> bytes:
    """Return the parts of faces that smooth borders give to another region, as a `packet`.

    The parts are triangles. ``sources`` is the face of each part, and ``shown`` the face as which
    it is drawn: a face near the part, of the region that gets it. The result is empty if cells are
    not faces, or are more than `MOST_CUT`.
    """
    cells, labels = document.cells, document.revisions.get(_number(query)).labels
    if not kind_of(cells).has_faces or document.n_cells > MOST_CUT:
        return packet({}, {})
    cut = cut_borders(as_mesh(cells), labels, n_threads=1)  # the browser draws at the same time
    faces, n = cut.mesh.faces, np.int64(cut.mesh.n_vertices)
    is_part = cut.labels != labels[cut.sources]
    near = np.flatnonzero(np.isin(faces, faces[is_part]).any(axis=1))
    shown = np.where(is_part, -1, cut.sources)[near]
    numbers = np.unique(faces[near] + n * cut.labels[near, None], return_inverse=True)[1]
    places = numbers.reshape(-1, 3)  # of corners: a vertex and a region
    before = np.empty(0)
    while not np.array_equal(before, shown):  # in rounds, parts get the face of a neighbor
        before, known = shown, np.full(places.max(initial=0) + 1, -1)
        np.maximum.at(known, places, shown[:, None])
        shown = np.where(shown < 0, known[places].max(axis=1), shown)
    is_drawn = is_part[near] & (shown >= 0)
    parts = near[is_drawn]
    used, triangles = np.unique(faces[parts], return_inverse=True)
    positions = (cut.mesh.vertices[used] - cells.bounds.mean(axis=0)).astype(np.float32)
    arrays = {
        "triangles": triangles.reshape(-1, 3),
        "sources": cut.sources[parts],
        "shown": shown[is_drawn],
    }
    whole = {name: array.astype(np.uint32) for name, array in arrays.items()}
    return packet({}, {"positions": positions, **whole})


def _suggestion_packet(document: Document, query: Body) -> bytes:
    """Return the list of suggestions, and for each cell the number of its suggestion, or 0.

    Suggestions are numbered from 1, in the order of the list. A cell in several suggestions has the
    number of the last of them.
    """
    owners = np.zeros(document.n_cells, np.uint32)
    entries = []
    for index, one in enumerate(document.state.suggestions, 1):
        cells = unpack_cells(one.cells, document.n_cells)
        owners[cells] = index
        entry = {"id": one.id, "class": one.class_id, "score": one.score}
        area = float(document.areas[cells].sum())
        entries.append({**entry, "n_cells": len(cells), "area": area})
    return packet({"suggestions": entries}, {"owners": owners})


def _exported(document: Document, query: Body) -> Response:
    what, format = str(query.get("what", "cells")), str(query.get("format"))
    name, content = export_bytes(document, what, format)
    quoted = quote(name, errors="surrogateescape")
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quoted}"}
    return Response(content, media_type=BYTES, headers=headers)


READS: dict[str, Operation] = {
    "labels": lambda document, query: (
        document.revisions.get(_number(query)).labels.astype("<i4").tobytes()
    ),
    "paint": lambda document, _: document.state.paint.astype("<u4").tobytes(),
    "export": _exported, "mesh": _mesh_packet, "regions": _region_packet, "state": _state,
    "suggestions": _suggestion_packet,
    "theirs": lambda document, _: (  # empty if no work file is compared
        b"" if document.theirs is None else document.theirs.paint.astype("<u4").tobytes()
    ),
}  # fmt: skip


def _paint(document: Document, body: Body) -> Body:
    class_id, object_id = _object_in(body)
    stroke = body.get("stroke")
    if stroke is not None and not (isinstance(stroke, str) and len(stroke) <= MAX_STROKE):
        raise ValueError(f"stroke must be a string of at most {MAX_STROKE} characters")
    part = _whole(body["part"], "part") if "part" in body else None
    cells = cells_from(body.get("cells"), document.n_cells)
    change = document.paint(cells, class_id, stroke, objects=object_id, part=part)
    return {"changed": 0 if change is None else change.after.n}


def _similar(document: Document, body: Body) -> Body:
    revision = document.revisions.get(body.get("revision"))
    graph = revision.graph(document.segmenter.surface)
    region = _whole(body.get("region"), "region")
    return {"regions": similar_regions(graph, region, body.get("tolerance", 0.1))}


def _compare(document: Document, body: Body) -> Body:
    """Compare with the work file in the request; if there is none, with the previous work file."""
    files = _files(body) if "files" in body else {}
    if len(files) > 1:
        raise ValueError("choose a single work file to compare with")
    for name, data in files.items():
        document.compare(name, data)
    return _compared(document)


def _accept(document: Document, body: Body) -> Body:
    cells = cells_from(body.get("cells"), document.n_cells)
    side = checked_choice(str(body.get("side")), "side", ("mine", "theirs"))
    document.accept(cells, cast(Side, side))
    return _compared(document)


def _compared(document: Document) -> Body:
    if document.theirs is None:
        return {"agreement": None, "classes": [], "differs": "", "bare": ""}
    is_bare = (document.state.paint == 0) & (document.theirs.paint > 0)
    return {
        "agreement": document.agreement(),
        "classes": list(document.theirs.class_list),
        "differs": base64_of(document.differing()),
        "bare": base64_of(np.flatnonzero(is_bare).astype(np.uint32)),
    }


def _set_classes(document: Document, body: Body) -> Body:
    document.set_classes(body.get("classes"))
    return {"classes": list(document.class_list)}


def _split(document: Document, body: Body) -> Body:
    strokes = []
    for name in ("red", "blue"):
        stroke, whole = _numbers(body.get(name), name), counted(document.n_cells, "cell")
        if stroke and not 0 <= min(stroke) <= max(stroke) < document.n_cells:
            raise ValueError(f"{name} contains a cell that does not exist: the mesh has {whole}")
        strokes.append(np.unique(np.array(stroke, np.uint32)))
    region = _whole(body.get("region"), "region")
    cells = document.split(region, body.get("revision"), *strokes)
    return {**regions_of(document.revision), "cells": base64_of(cells)}


def _refine(document: Document, body: Body) -> Body:
    region, n_parts = _whole(body.get("region"), "region"), _whole(body.get("parts"), "parts")
    document.refine(region, body.get("revision"), n_parts)
    return regions_of(document.revision)


def _export(document: Document, body: Body) -> Body:
    what, format = str(body.get("what", "cells")), str(body.get("format"))
    path = write_export(document, what, format, replace=body.get("replace") is True)
    return {"path": str(path), "name": path.name}


def _import(document: Document, body: Body) -> Body:
    imported = read_import(_files(body), document.cells, document.class_list)
    if checked_flag(body.get("as_suggestions", False), "as_suggestions"):
        return {"suggested": document.suggest(imported)}
    change = document.apply_import(imported)
    changed = 0 if change is None else change.after.n
    return {"changed": changed, "classes": list(document.class_list)}


def _settle(document: Document, body: Body) -> Body:
    """Accept suggestions, given as pairs (id, class), and reject suggestions, given as ids."""
    pairs = body.get("accept", [])
    if not isinstance(pairs, list) or not all(
        isinstance(pair, list) and len(pair) == 2 for pair in pairs
    ):
        raise ValueError("accept must be a list of pairs of a suggestion and a class")
    accepted = {_whole(one, "suggestion"): _whole(class_id, "class") for one, class_id in pairs}
    rejected = _numbers(body.get("reject", []), "reject")
    return _effect(document, document.settle(accepted, rejected))


def _files(body: Body) -> dict[str, bytes]:
    given = body.get("files")
    if not isinstance(given, list) or not all(isinstance(file, dict) for file in given):
        raise ValueError("files must be a list of objects with a name and data")
    return {str(file.get("name")): bytes_from(file.get("data")) for file in given}


OPERATIONS: dict[str, Operation] = {
    "undo": lambda document, _: _effect(document, document.undo()),
    "redo": lambda document, _: _effect(document, document.redo()),
    "split-object": lambda document, body: {"objects": document.split_object(*_object_in(body))},
    "name-object": lambda document, body: document.name_object(*_object_in(body), body.get("name")),
    "review": lambda document, body: (
        document.review(checked_flag(body.get("reviewed"), "reviewed"))
    ),
    "paint": _paint, "similar": _similar, "split": _split, "refine": _refine, "settle": _settle,
    "classes": _set_classes, "compare": _compare, "accept": _accept,
    "export": _export, "import": _import,
}  # fmt: skip


def _object_in(body: Body) -> tuple[int, int]:
    """Return the class and the object number in a request; without number, the object is 0."""
    return _whole(body.get("class"), "class"), checked_object(body.get("object", 0))


def _numbers(value: object, name: str) -> list[int]:
    if not isinstance(value, list):
        raise ValueError(f"{name} must be a list of numbers")
    return [_whole(number, f"each of {name}") for number in value]


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} must be a whole number")
    return value


def _number(query: Body) -> int:
    text = str(query.get("revision", ""))
    if not text.isdecimal() or len(text) > MAX_DIGITS:
        raise ValueError("revision must be a number, such as the revision in the state")
    return int(text)
