"""
Regions by color
================

Let borders follow colors on a surface without creases.
"""

import numpy as np

import superfacets as sf


def rug(n=60_000):
    """Return a rug of colored points, with stripes at both ends and diamonds in the middle."""
    rng = np.random.default_rng(0)
    x, y = rng.random((2, n)) * [[3.0], [2.0]]
    heights = 0.06 * np.sin(2.5 * x + 1) * np.cos(2 * y)
    paints = np.array([[140, 30, 35], [225, 205, 160], [35, 55, 95], [190, 120, 50]])
    stripe = np.floor(6 * np.minimum(x, 3 - x)).astype(int)
    across = np.abs((x - 0.5) % 0.5 - 0.25) / 0.25 + np.abs(y % 0.5 - 0.25) / 0.25
    paint = np.where(stripe < 3, stripe, 3 * (across < 0.5) + (across > 1))
    colors = paints[paint] + rng.normal(scale=8, size=(n, 3))
    shades = np.clip(colors, 0, 255).astype(np.uint8)
    return sf.PointCloud(np.stack([x, y, heights], axis=1), colors=shades)


cloud = rug()
view = sf.View(up="z", azimuth=0, elevation=60)
sf.plot(cloud, colors=np.rint(255 * cloud.colors).astype(np.uint8), view=view)

# %%
# ``features="color"`` adds the difference of colors to the cost of a step. On a mesh, these are
# the colors of faces or vertices, or the texture.

by_shape = sf.segment(cloud, 300).labels
by_color = sf.segment(cloud, 300, features="color").labels
titles = ["by shape", "by color"]
sf.plot(cloud, by_shape, compare=[by_color], titles=titles, view=view, size=(560, 420))

# %%
# Features may be any array with one row per face or point, such as the output of a network. The
# last picture shows the mean color of each region.

mean = sf.pool(by_color, cloud.colors, mesh=cloud)
sf.plot(cloud, colors=np.rint(255 * mean[by_color]).astype(np.uint8), view=view)
