"""Answers of the server about a document, as JSON and as bytes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..cells.kinds import kind_of
from ..pictures.camera import View
from ..pictures.colors import PALETTE
from ..pictures.page.shape import shape_of, view_facts
from .coding import base64_of, packet
from .document import Document
from .exports import formats_of
from .history import Change
from .revisions import Revision
from .segmenting import levels_of, ranges

__all__ = ["counts_of", "mesh_packet", "moved", "regions_packet", "state_of"]


def state_of(document: Document) -> dict[str, Any]:
    """State of a document for a client that begins, without arrays."""
    with document.lock:
        parameters, kind = document.state.partition.parameters, document.source.kind
        return {
            "parameters": parameters,
            "ranges": ranges(document.n_cells),
            "revision": document.revision.number,
            "n_regions": document.revision.n_regions,
            "classes": list(document.class_list),
            "levels": levels_of(parameters["n_segments"]),
            "input": document.source.facts["file"] | {"n_cells": document.n_cells, "kind": kind},
            "exports": formats_of(kind),
            "work": str(document.journal.path),
            "notes": [*document.notes, *document.base.notes],
            **counts_of(document),
        }


def counts_of(document: Document) -> dict[str, Any]:
    """The facts that every operation changes."""
    with document.lock:
        return {
            "seq": document.history.seq,
            "progress": document.progress,
            "can_undo": bool(document.history.undo_stack),
            "can_redo": bool(document.history.redo_stack),
        }


def moved(document: Document, changes: list[Change]) -> dict[str, Any]:
    """Effect of an undo or a redo: cells with their classes now, the revision, the classes."""
    with document.lock:
        parts = [change.cells(document.n_cells) for change in changes]
        cells = np.unique(np.concatenate(parts))
        return {
            "kind": changes[-1].kind,
            "cells": base64_of(cells.astype(np.uint32)),
            "classes": base64_of(document.state.classes[cells]),
            "revision": document.revision.number,
            "n_regions": document.revision.n_regions,
            "parameters": document.state.partition.parameters,
            "class_list": list(document.class_list),
            **counts_of(document),
        }


def regions_packet(document: Document, revision: Revision) -> bytes:
    """The arcs between neighboring regions, uint32 of shape (A, 2), as one block, see `packet`."""
    graph = revision.graph(document.segmenter.surface)
    header = {"revision": revision.number, "n_regions": revision.n_regions}
    return packet(header, {"arcs": graph.edge_index.T.astype(np.uint32)})


def mesh_packet(document: Document) -> bytes:
    """The shape of a mesh as one block, see `packet`.

    Positions are float32 around the center of the bounding box. Vertices are in the order in which
    triangles use them, no two at one place. Triangles of polygons, and of the outside of
    tetrahedra, have ``sources``: the cell of each. Points have packed ``normals``.
    """
    shape = shape_of(document.cells)
    center = document.cells.bounds.mean(axis=0)
    header = {
        "kind": document.source.kind,
        "n_cells": document.n_cells,
        "center": center.tolist(),
        "measure": "volume" if kind_of(document.cells).dimension == 3 else "area",
        **view_facts(shape, View()),
        "low": [0, 0, 0],
        "step": [1, 1, 1],
        "point_size": shape.point_size * shape.diagonal,
        "palette": PALETTE.tolist(),
    }
    parts = shape.parts((shape.points - center).astype(np.float32))
    arrays: dict[str, Any] = {name: array for name, (array, _) in parts.items()}
    return packet(header, {**arrays, "areas": document.areas.astype(np.float32)})
