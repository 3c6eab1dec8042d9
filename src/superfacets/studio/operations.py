"""What can be read of a document and done with it: the name of each is that of its route."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from urllib.parse import quote

import numpy as np
from starlette.responses import Response

from .answers import counts_of, mesh_packet, moved, regions_packet, state_of
from .coding import base64_of, bytes_from, cells_from
from .document import Document
from .exports import export, export_bytes
from .imports import read_import
from .replies import Body
from .revisions import similar_regions

__all__ = ["OPERATIONS", "READS", "Operation"]

Operation = Callable[[Document, Body], Any]
"""Takes what the request says: the query, or the JSON object in it."""

OCTETS = "application/octet-stream"

LARGEST = (1 << 63) - 1
"""Number that arrays hold."""

MAX_DIGITS = 20
"""Of the number of a revision."""

MAX_STROKE = 64
"""Characters in the name of a stroke."""


def _read_classes(document: Document, query: Body) -> Response:
    with document.lock:
        return Response(document.state.classes.astype("<u2").tobytes(), media_type=OCTETS)


def _read_labels(document: Document, query: Body) -> Response:
    revision = document.revisions.get(_number(query))
    return Response(revision.labels.astype("<i4").tobytes(), media_type=OCTETS)


def _read_mesh(document: Document, query: Body) -> Response:
    return Response(mesh_packet(document), media_type=OCTETS)


def _read_regions(document: Document, query: Body) -> Response:
    revision = document.revisions.get(_number(query))
    return Response(regions_packet(document, revision), media_type=OCTETS)


def _read_export(document: Document, query: Body) -> Response:
    what, format = str(query.get("what", "cells")), str(query.get("format"))
    name, content = export_bytes(document, what, format)
    quoted = quote(name, errors="surrogateescape")
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quoted}"}
    return Response(content, media_type=OCTETS, headers=headers)


READS: dict[str, Operation] = {
    "classes": _read_classes,
    "export": _read_export,
    "labels": _read_labels,
    "mesh": _read_mesh,
    "regions": _read_regions,
    "state": lambda document, query: state_of(document),
}


def _paint(document: Document, body: Body) -> Body:
    number = _whole(body.get("class"), "class")
    stroke = body.get("stroke")
    if stroke is not None and not (isinstance(stroke, str) and len(stroke) <= MAX_STROKE):
        raise ValueError(f"stroke must be a text of up to {MAX_STROKE} characters")
    if "regions" in body:
        cells = document.revisions.get(body.get("revision")).cells_of_all(
            _numbers(body["regions"], "regions")
        )
    else:
        cells = cells_from(body.get("cells"), document.n_cells)
    with document.lock:
        change = document.paint(cells, number, stroke)
        return {"changed": 0 if change is None else change.after.n, **counts_of(document)}


def _undo(document: Document, body: Body) -> Body:
    with document.lock:
        return moved(document, document.undo())


def _redo(document: Document, body: Body) -> Body:
    with document.lock:
        return moved(document, document.redo())


def _similar(document: Document, body: Body) -> Body:
    revision = document.revisions.get(body.get("revision"))
    graph = revision.graph(document.segmenter.surface)
    region = _whole(body.get("region"), "region")
    return {"regions": similar_regions(graph, region, body.get("tolerance", 0.1))}


def _set_classes(document: Document, body: Body) -> Body:
    with document.lock:
        document.set_classes(body.get("classes"))
        return {"classes": list(document.class_list), **counts_of(document)}


def _split(document: Document, body: Body) -> Body:
    strokes = []
    for name in ("red", "blue"):
        stroke = _numbers(body.get(name), name)
        given = np.unique(np.asarray(stroke, np.int64))
        if len(given) and not 0 <= given[0] <= given[-1] < document.n_cells:
            raise ValueError(f"{name} holds a cell that is none of {document.n_cells}")
        strokes.append(given.astype(np.uint32))
    region = _whole(body.get("region"), "region")
    with document.lock:
        cells = document.split(region, body.get("revision"), *strokes)
        revision = document.revision
        found = {"revision": revision.number, "n_regions": revision.n_regions}
        return {**found, "cells": base64_of(cells), **counts_of(document)}


def _export(document: Document, body: Body) -> Body:
    what, format = str(body.get("what", "cells")), str(body.get("format"))
    path = export(document, what, format, replace=body.get("replace") is True)
    return {"path": str(path), "name": path.name}


def _import(document: Document, body: Body) -> Body:
    given = body.get("files")
    if not isinstance(given, list) or not all(isinstance(file, dict) for file in given):
        raise ValueError("files must be a list of objects with a name and data")
    files = {str(file.get("name")): bytes_from(file.get("data")) for file in given}
    imported = read_import(files, document.cells, document.class_list)
    with document.lock:
        change = document.take(imported)
        changed = 0 if change is None else change.after.n
        return {"changed": changed, "classes": list(document.class_list), **counts_of(document)}


OPERATIONS: dict[str, Operation] = {
    "paint": _paint,
    "undo": _undo,
    "redo": _redo,
    "similar": _similar,
    "classes": _set_classes,
    "split": _split,
    "export": _export,
    "import": _import,
}


def _numbers(value: object, name: str) -> list[int]:
    if not isinstance(value, list):
        raise ValueError(f"{name} must be a list of numbers")
    return [_whole(number, f"each of {name}") for number in value]


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} must be a whole number")
    if abs(value) > LARGEST:
        raise ValueError(f"{name} must be a whole number of 64 bits")
    return value


def _number(query: Body) -> int:
    text = str(query.get("revision", ""))
    if not text.isdecimal() or len(text) > MAX_DIGITS:
        raise ValueError("revision must be a number, as the state has it")
    return int(text)
