"""
A volume of tetrahedra
======================

Divide the volume of a solid into compact regions.
"""

import numpy as np

import superfacets as sf


def body(n=12):
    """Return a ball with bumps, made of n**3 hexahedra with six tetrahedra each."""
    side = np.linspace(-1, 1, n + 1)
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    scale = np.maximum(np.abs(x), np.maximum(np.abs(y), np.abs(z)))  # from a cube to a ball
    length = np.sqrt(x**2 + y**2 + z**2)
    stretch = np.divide(scale, length, out=np.ones_like(scale), where=length > 0)
    stretch *= 1 + 0.25 * np.sin(3 * x) * np.sin(3 * y + 1) * np.cos(2 * z)
    points = np.stack([stretch * x, stretch * y, stretch * z], axis=-1).reshape(-1, 3)
    step_y, step_z = n + 1, (n + 1) ** 2
    k, j, i = np.indices((n, n, n)).reshape(3, -1)
    first = k * step_z + j * step_y + i
    corners = [a + b * step_y + c * step_z for c in (0, 1) for b in (0, 1) for a in (0, 1)]
    around = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
    tets = first[:, np.newaxis, np.newaxis] + np.array(corners)[np.array(around)]
    return sf.TetMesh(points, tets.reshape(-1, 4))


mesh = body()
result = sf.segment(mesh, 60)

# %%
# ``clip`` hides the tetrahedra above the middle.

sf.plot(mesh, result, clip="-z", view=sf.View(up="z", elevation=40))

# %%
# Regions have volumes instead of areas, and borders have areas instead of lengths.

regions = result.regions
print(f"volumes from {regions.measures.min():.3f} to {regions.measures.max():.3f}")

# %%
# ``boundary`` returns the outer surface as a mesh of triangles, and the tetrahedron of each
# triangle.

surface, sources = mesh.boundary()
sf.plot(surface, result.labels[sources], view=sf.View(up="z", elevation=40))
