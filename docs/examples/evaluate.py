"""
Measure labels against ground truth
===================================

Compare regions with the true objects of a room, for several numbers of regions.
"""

import matplotlib.pyplot as plt
import numpy as np

import superfacets as sf

# %%
# The room consists of boxes, and each box belongs to an object: floor and walls, a table, two
# chairs, or a cupboard.


def box(x, y, z, dx, dy, dz):
    """Return a box from a corner and its sides."""
    points = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1]]
    quads += [[2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[[a, b, c], [a, c, d]] for a, b, c, d in quads]
    return sf.Mesh([x, y, z] + points * [dx, dy, dz], np.reshape(faces, (-1, 3)))


def merged(parts):
    """Return one mesh with the faces of all parts."""
    starts = np.cumsum([0, *(part.n_vertices for part in parts[:-1])])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return sf.Mesh(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def room():
    """Return a room, z up and in meters, and the object of each face."""
    corners = [[0, 0, 0], [3.8, 0, 0], [3.8, 3, 0], [0, 3, 0]]
    corners += [[0, 0, 2], [3.8, 3, 2], [0, 3, 2]]
    walls = [[0, 1, 2], [0, 2, 3], [3, 2, 5], [3, 5, 6], [0, 3, 6], [0, 6, 4]]
    floor = sf.Mesh(corners, walls)
    objects = [[floor], [box(1.5, 1.2, 0.7, 1.6, 0.9, 0.05)]]
    positions = [(x, y) for x in (1.55, 2.99) for y in (1.25, 1.99)]
    objects[1] += [box(x, y, 0, 0.06, 0.06, 0.7) for x, y in positions]
    positions = [(x, y) for x in (0, 0.41) for y in (0.7, 1.11)]
    for left in (1.7, 2.5):
        legs = [box(left + x, y, 0, 0.04, 0.04, 0.42) for x, y in positions]
        seat = box(left, 0.7, 0.42, 0.45, 0.45, 0.05)
        objects.append([seat, box(left, 0.7, 0.47, 0.45, 0.05, 0.45), *legs])
    objects.append([box(2.5, 2.55, 0, 1.2, 0.4, 1.7)])
    parts = [part for parts in objects for part in parts]
    n_faces = [sum(part.n_faces for part in parts) for parts in objects]
    truth = np.repeat(np.arange(len(objects)), n_faces)
    fine = sf.subdivide(merged(parts), 0.06)
    return fine.mesh, truth[fine.sources]


mesh, truth = room()
view = sf.View(up="z", azimuth=60, elevation=40)
labels = sf.segment(mesh, 300, islands="nearest").labels
sf.plot(mesh, labels, compare=[truth], titles=["300 regions", "truth"], view=view)

# %%
# The undersegmentation error is the area by which regions extend across true borders; 0 is best.
# The achievable accuracy is the fraction of the area that is correct if each region gets its
# majority label; 1 is best.

truths = sf.metrics.GroundTruths(mesh, [truth])
counts = [25, 50, 100, 200, 400]
results = [sf.segment(mesh, k, islands="nearest") for k in counts]
rows = [sf.metrics.evaluate(mesh, result, truths) for result in results]
for k, row in zip(counts, rows, strict=True):
    print(f"{k:4} regions: error {row['undersegmentation_error']:.4f},", end=" ")
    print(f"achievable accuracy {row['achievable_accuracy']:.2%}")

# %%
# With more regions, the error is usually lower. Therefore compare methods and parameters at the
# same number of regions.

figure, axis = plt.subplots(figsize=(6, 3))
axis.semilogx(counts, [row["undersegmentation_error"] for row in rows], "o-")
axis.set(xlabel="regions", ylabel="undersegmentation error", ylim=0)
axis.set_xticks(counts, counts, minor=False)
axis.minorticks_off()
figure.tight_layout()
