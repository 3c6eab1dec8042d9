"""What the server tells of a document, as JSON and as bytes."""

from __future__ import annotations

from typing import Any

import numpy as np

from .changes import Change
from .coding import base64_of, packet
from .document import Document
from .exports import formats_of
from .parameters import ranges
from .revisions import Revision
from .segmenting import levels_of
from .similar import FEATURES, features_of


def state_of(document: Document) -> dict[str, Any]:
    """All that a client needs to begin, but the arrays."""
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
    """What every operation changes."""
    with document.lock:
        return {
            "seq": document.replay.seq,
            "progress": document.progress,
            "can_undo": bool(document.replay.undo_stack),
            "can_redo": bool(document.replay.redo_stack),
        }


def moved(document: Document, changes: list[Change]) -> dict[str, Any]:
    """What an undo or a redo did: cells with their classes now, the revision, the classes."""
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
    """Areas, centroids, arcs and features of regions as one block, see `packet`.

    Centroids are around the same center as the positions of the mesh.
    """
    graph = revision.graph(document.segmenter.surface)
    arrays = {
        "areas": graph.measures.astype(np.float32),
        "centroids": (graph.centroids - document.cells.bounds.mean(axis=0)).astype(np.float32),
        "arcs": graph.edge_index.T.astype(np.uint32),
        "features": features_of(graph).astype(np.float32),
    }
    header = {"revision": revision.number, "n_regions": revision.n_regions}
    return packet({**header, "features": list(FEATURES)}, arrays)
