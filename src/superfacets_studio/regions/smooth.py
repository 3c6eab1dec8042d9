"""Find the parts of faces that are drawn in the color of another region, for smooth borders."""

from __future__ import annotations

import numpy as np

from superfacets import cut_borders
from superfacets.kit import Floats, Ints, Longs, MeshLike


def parts_beyond_borders(mesh: MeshLike, labels: Ints) -> tuple[Floats, Longs, Ints, Longs]:
    """Return the parts of faces that the curves of `cut_borders` give to another region.

    The arrays are vertices, the corners of each part, (n, 3), its face, (n,), and the face as which
    it is drawn, (n,): a face near the part, of the region that gets the part. `labels` is the region
    of each face. Uses one thread, so that the browser can draw at the same time.
    """
    cut = cut_borders(mesh, labels, n_threads=1)
    faces, is_moved = cut.mesh.faces, cut.labels != labels[cut.sources]
    is_touched = np.zeros(cut.mesh.n_vertices, dtype=bool)
    is_touched[faces[is_moved]] = True
    near = np.flatnonzero(is_touched[faces].any(axis=1))
    shown = np.where(is_moved, -1, cut.sources)[near].astype(np.int64)
    # Parts get the faces of parts of their region at the same vertices, in rounds.
    keys = faces[near] + cut.labels[near, None] * np.int64(cut.mesh.n_vertices)
    used, places = np.unique(keys, return_inverse=True)
    places = places.reshape(-1, 3)
    while True:
        known = np.full(len(used), -1)
        np.maximum.at(known, places, shown[:, None])
        found = np.where(shown < 0, known[places].max(axis=1), shown)
        if np.array_equal(found, shown):
            break
        shown = found
    is_drawn = is_moved[near] & (shown >= 0)
    parts = near[is_drawn]
    used, corners = np.unique(faces[parts], return_inverse=True)
    return cut.mesh.vertices[used], corners.reshape(-1, 3), cut.sources[parts], shown[is_drawn]
