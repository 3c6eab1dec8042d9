"""Read surfaces and labels of brain cortex meshes with nibabel: GIFTI and FreeSurfer files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..._types import Array
from ...errors import MeshError, import_extra, reason_of
from ..guards import Arrays, Content, as_doubles, shortened, temporary_file
from .text import as_integers

SURFACE_ENDINGS = (".white", ".pial", ".inflated", ".smoothwm", ".orig", ".sphere")
"""Endings of FreeSurfer surfaces, for example ``lh.white``."""

TRIANGLES = b"\xff\xff\xfe"
"""First bytes of FreeSurfer files with a surface of triangles."""


def read_gifti(data: Content) -> Arrays:
    """Return vertices and triangles of a GIFTI surface; its transforms are not applied."""
    points, triangles = _gifti_arrays(data, "POINTSET", "TRIANGLE")
    if points is None or triangles is None:
        raise MeshError("the GIFTI file has no surface: points or triangles are missing")
    if points.shape[1:] != (3,) or triangles.shape[1:] != (3,):
        raise MeshError("points and triangles of a GIFTI file must have 3 numbers each")
    return as_doubles(points), as_integers(triangles, "vertex indices")


def gifti_labels(data: Content) -> Array:
    """Return the label of each vertex: its key minus 1. Key 0 means no region and becomes -1."""
    (keys,) = _gifti_arrays(data, "LABEL")
    if keys is None or keys.ndim != 1:
        raise MeshError("the GIFTI file has no labels of vertices")
    return np.maximum(as_integers(keys, "labels").astype(np.int64), 0) - 1


def _gifti_arrays(data: Content, *intents: str) -> list[Array | None]:
    """Return the first array with each NIfTI intent, or None for an intent without an array."""
    if data.find(b"ExternalFileBinary") >= 0:  # for security, refuse names of other files
        raise MeshError("the GIFTI file refers to another file: save all arrays in one file")

    def read(nibabel: Any) -> list[Array | None]:
        image = nibabel.GiftiImage.from_bytes(data[:])
        found = [image.get_arrays_from_intent(f"NIFTI_INTENT_{intent}") for intent in intents]
        return [np.asarray(arrays[0].data) if arrays else None for arrays in found]

    found: list[Array | None] = _read("GIFTI", read)
    return found


def read_surface(data: Content) -> Arrays:
    """Return vertices and triangles of a FreeSurfer surface."""
    if data[:3] != TRIANGLES:
        raise MeshError("not a FreeSurfer surface of triangles: the magic number is missing")
    with temporary_file(data, "surface") as path:
        vertices, faces = _read(
            "FreeSurfer", lambda nibabel: nibabel.freesurfer.read_geometry(path)
        )
    return as_doubles(vertices), faces.astype(np.int32)


def annot_labels(data: Content) -> Array:
    """Return the label of each vertex: its row in the color table minus 1; -1 means no region."""
    with temporary_file(data, "labels.annot") as path:
        rows, *_ = _read("FreeSurfer", lambda nibabel: nibabel.freesurfer.read_annot(path))
    return np.maximum(np.asarray(rows, np.int64), 0) - 1


def _read(what: str, read: Callable[[Any], Any]) -> Any:
    """Return ``read(nibabel)``, or raise a MeshError if nibabel raises an exception."""
    nibabel = import_extra("nibabel", f"a {what} file", "cortex")
    try:
        return read(nibabel)
    except Exception as error:  # nibabel raises exceptions of many classes
        raise MeshError(f"the {what} file is damaged: {shortened(reason_of(error))}") from None
