"""
A terrain
=========

Divide a height field into slopes and hills.
"""

import numpy as np

import superfacets as sf


def terrain(n=220):
    """Return ridges and valleys on a square of 100 by 100 meters, z up."""
    rng = np.random.default_rng(4)
    frequency = np.fft.fftfreq(n, 1 / n)
    length = np.hypot(frequency[:, None], frequency[None, :])
    length[0, 0] = np.inf
    waves = np.fft.fft2(rng.normal(size=(n, n))) / length**2.2
    hills = np.fft.ifft2(waves).real
    heights = 12 * np.abs(hills / hills.std())
    x, y = np.meshgrid(np.linspace(0, 100, n), np.linspace(0, 100, n), indexing="ij")
    return grid(np.stack([x, y, heights], axis=2))


def grid(points):
    """Return the surface of a grid of points, shape (rows, columns, 3).

    The surface faces up if x grows along each column and y along each row, as here, or if rows go
    from north to south and columns from west to east, as in most rasters. Otherwise, reverse the
    rows with ``points[::-1]``, or creases that are convex from above are treated as concave.
    """
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = [np.stack(corners, axis=2).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return sf.Mesh(points.reshape(-1, 3), np.concatenate(faces))


# %%
# Borders follow the bottoms of valleys, so each region is a slope or a hill. With a larger
# ``alpha``, borders also follow faint valleys.

mesh = terrain()
result = sf.segment(mesh, 250, alpha=60)
view = sf.View(up="z", elevation=45)
sf.plot(mesh, result, view=view)

# %%
# The slope of a region follows from ``regions.normals``; a slope of 0 degrees is horizontal.
# ``sf.pool`` computes means of other values, such as the height.

slope = np.degrees(np.arccos(np.abs(result.regions.normals[:, 2])))
height = sf.pool(result.labels, mesh.vertices[:, 2], mesh=mesh)
print(f"the steepest region has {slope.max():.0f} degrees, and the highest {height.max():.0f} m")
sf.plot(mesh, result, color_by=slope, scale_title="degrees", view=view)
