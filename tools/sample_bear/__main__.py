"""``python -m tools.sample_bear``: write the sample meshes of the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import make_bear

FOLDER = Path(__file__).resolve().parents[2] / "src" / "superfacets" / "sample"

SIZES = {"bear-5k.npz": 5_000, "bear-60k.npz": 60_000}
"""The demo uses the large mesh; tests and examples use the small mesh."""


def main() -> None:
    """Write vertices in single precision, and faces as differences of consecutive corners.

    Consecutive faces have similar vertex indices, so compressed differences need less than half of
    the space.
    """
    for name, n_faces in SIZES.items():
        vertices, faces = make_bear(n_faces)
        steps = np.diff(faces.ravel(), prepend=0).astype(np.int32)
        np.savez_compressed(FOLDER / name, vertices=vertices.astype(np.float32), steps=steps)


if __name__ == "__main__":
    main()
