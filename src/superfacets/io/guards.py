"""Checks that several readers share."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import MeshError

__all__ = ["Arrays", "as_doubles", "check_triangles", "counted", "known_ending", "read_bytes"]

Arrays = tuple[npt.NDArray[np.float64], npt.NDArray[Any]]
"""Vertices (V, 3) and faces (F, 3) as the file has them; `Mesh` checks indices and coordinates."""


def known_ending(path: Path, endings: Sequence[str]) -> str:
    """The ending of `path` in lower case; a MeshError if it is none of `endings`."""
    ending = path.suffix.lower()
    if ending not in endings:
        raise MeshError(f"{path}: expected the ending {', '.join(endings)}, got {ending or 'none'}")
    return ending


def read_bytes(path: Path) -> bytes:
    """Content of a regular file, as a pipe would hang us; an OSError or a MeshError without one."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: no such file") from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(f"{path}: is a folder, not a file")
    if not stat.S_ISREG(mode):
        raise OSError(f"{path}: is not a regular file")
    if not os.access(path, os.R_OK):
        raise PermissionError(f"{path}: may not be read")
    data = path.read_bytes()
    if not data:
        raise MeshError(f"{path}: the file is empty")
    return data


def as_doubles(values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Copy of `values` as float64, without the warning that numpy gives for some kinds of NaN."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def check_triangles(corner_counts: npt.NDArray[Any]) -> None:
    """Raise a MeshError that counts the faces which are not triangles, if there are any."""
    others = np.flatnonzero(corner_counts != 3)
    if not len(others):
        return
    first = int(others[0])
    n_corners = int(corner_counts[first])
    if n_corners < 3:
        raise MeshError(
            f"faces[{first}] has {counted(n_corners, 'corner')}: is the file cut or damaged?"
        )
    raise MeshError(
        f"{len(others)} of {len(corner_counts)} faces are polygons, the first is faces[{first}]"
        f" with {n_corners} corners; only triangles are supported yet: triangulate the mesh first"
    )


def counted(n: int, thing: str) -> str:
    """A number with its noun, as in "1 face" and "2 faces"."""
    return f"{n} {thing}" if n == 1 else f"{n} {'vertices' if thing == 'vertex' else thing + 's'}"
