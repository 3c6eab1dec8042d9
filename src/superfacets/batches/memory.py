"""Estimate the memory that a file will need before it is read."""

from __future__ import annotations

from pathlib import Path

BASE = 150 << 20
"""Bytes of a worker that has imported everything and read nothing."""

PER_CELL = 200
"""Bytes for a cell besides the mesh: graph, weights, labels, and what stages need for a while. With
1.4 million faces in PLY, OFF and STL whole processes took a third to a half of the estimate."""

PER_BYTE = 3
"""Bytes for one of the file: its content, the mesh made of it, and the mesh to be written."""

FILE_BYTES = {".stl": 50, ".ply": 18, ".obj": 30, ".off": 30, ".tri": 30, ".laz": 3, ".vtp": 6}
"""Bytes of a file for a cell, at least; compressed files have few."""

USUAL_FILE_BYTES = 12


def cells_of(path: str) -> int:
    """Number of cells that a file may hold, told by its size and ending; 0 if it is not there."""
    return _size_of(path) // FILE_BYTES.get(Path(path).suffix.lower(), USUAL_FILE_BYTES)


def memory_of(path: str) -> int:
    """Bytes that a process will need to segment a file: in most cases at most this."""
    return BASE + PER_BYTE * _size_of(path) + PER_CELL * cells_of(path)


def _size_of(path: str) -> int:
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0
