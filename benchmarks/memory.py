"""Peak memory of `superfacets.segment`, without its input, in a fresh process.

The fresh process is ``python -m benchmarks.memory FOLDER K``. It reads ``vertices.npy`` and
``faces.npy`` in the folder, segments the mesh into K regions, and prints one line of JSON.
"""

from __future__ import annotations

import gc
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import superfacets as sf

from .checks import hash_labels
from .meshes import Arrays

ROOT = Path(__file__).resolve().parents[1]


def measure(mesh: str, arrays: Arrays, n_segments: int) -> dict[str, Any]:
    """Return a row of results with the peak memory in bytes per face.

    The peak includes the result, but neither the input nor the threads and buffers that remain from
    an earlier run on a smaller mesh. If there are no faces, the vertices are segmented as a point
    cloud.
    """
    n_faces = len(arrays.faces) or len(arrays.vertices)
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "vertices.npy", arrays.vertices)
        np.save(Path(folder) / "faces.npy", arrays.faces)
        command = [sys.executable, "-m", "benchmarks.memory", folder, str(n_segments)]
        printed = subprocess.run(
            command, cwd=ROOT, check=True, capture_output=True, text=True
        ).stdout
    measured = json.loads(printed)
    return {
        "mesh": mesh,
        "faces": n_faces,
        "k": n_segments,
        "input_bytes_per_face": (arrays.vertices.nbytes + arrays.faces.nbytes) / n_faces,
        "bytes_per_face": measured["peak_bytes"] / n_faces,
        "labels": measured["labels"],
    }


def _probe(folder: Path, n_segments: int) -> dict[str, Any]:
    """Segment the arrays in the folder; return the peak memory minus the memory before, in bytes.

    Also returns a hash of the labels.
    """
    sf.segment(sf.sample_mesh(5_000), 50)
    vertices, faces = np.load(folder / "vertices.npy"), np.load(folder / "faces.npy")
    gc.collect()
    before = _forget_peak()
    result = sf.segment((vertices, faces) if len(faces) else vertices, n_segments)
    peak_bytes = _resident_bytes("VmHWM") - before
    return {"peak_bytes": peak_bytes, "labels": hash_labels(result.labels)}


def _forget_peak() -> int:
    """Reset the peak memory, if the system allows it, and return the current memory in bytes."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return _resident_bytes("VmHWM")  # peak memory until now, which is mostly the input
    return _resident_bytes("VmRSS")


def _resident_bytes(field: str) -> int:
    """Return VmRSS (current memory) or VmHWM (peak memory) in bytes.

    On systems without /proc, the result is the peak memory for both fields.
    """
    status = Path("/proc/self/status")
    if status.exists():
        found = re.search(rf"{field}:\s+(\d+) kB", status.read_text())
        assert found, f"no {field} in /proc/self/status"
        return 1024 * int(found[1])
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    print(json.dumps(_probe(Path(sys.argv[1]), int(sys.argv[2]))))
