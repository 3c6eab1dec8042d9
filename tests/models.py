"""Read the benchmark's OFF files in three lines, so that tests of stages need no reader."""

import numpy as np

from superfacets import Mesh


def read_off(path):
    n_vertices, n_faces, *numbers = path.read_text().removeprefix("OFF").split()
    del numbers[0]  # edges
    split = 3 * int(n_vertices)
    faces = np.array(numbers[split:], dtype=np.int64).reshape(int(n_faces), 4)
    return Mesh(np.array(numbers[:split], dtype=np.float64).reshape(-1, 3), faces[:, 1:])
