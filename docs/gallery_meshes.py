"""Write the meshes of the gallery into a folder: ``python gallery_meshes.py gallery``.

Most are made here. Others are parts of packages from PyPI; those that are not installed are named
and left out: ``pip install pyvista`` and ``pip install --no-deps nilearn gymnasium-robotics``.
"""

import argparse
import base64
import gzip
import zlib
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

import superfacets as sf


def bear():
    return sf.sample_mesh()


def scan(n_faces=60_000):
    """The bear as a scanner in front of it sees it: one side, noise, holes and specks."""
    mesh = sf.sample_mesh(n_faces)
    rng = np.random.default_rng(0)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    centroids = corners.mean(axis=1)
    is_seen = normals @ np.array([0.35, 0.1, 0.93]) > rng.uniform(0.1, 0.3, mesh.n_faces)
    for hole in rng.choice(mesh.n_faces, 25):
        radius = rng.uniform(0.02, 0.06)
        is_seen &= np.linalg.norm(centroids - centroids[hole], axis=1) > radius
    noise = rng.normal(scale=0.002, size=mesh.vertices.shape)
    return sf.Mesh(mesh.vertices + noise, mesh.faces[is_seen])


def flange(n_around=96):
    """A pipe with a plate at its end, as CAD programs mesh them: two long faces per step around."""
    profile = [[0.3, 0], [1, 0], [1, 0.2], [0.5, 0.2], [0.5, 0.9], [0.3, 0.9], [0.3, 0]]
    return revolve(np.array(profile), n_around)


def revolve(profile, n_around, axis=(0.0, 0.0)):
    """The surface that a profile of (radius, z) sweeps, two triangles per step and side."""
    turns = 2 * np.pi * np.arange(n_around) / n_around
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    rings = [np.insert(axis + radius * around, 2, z, axis=1) for radius, z in profile]
    return sf.Mesh(np.concatenate(rings), ring_faces(len(profile), n_around))


def ring_faces(n_rings, n_around):
    """Faces between each of n_rings rings of vertices and the next."""
    step, ring = np.meshgrid(np.arange(n_around), np.arange(n_rings - 1))
    a = (ring * n_around + step).ravel()
    b = (ring * n_around + (step + 1) % n_around).ravel()
    c, d = b + n_around, a + n_around
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def gears():
    """Twelve gears, each with a pin and six bolts: 96 components."""
    parts = []
    for row in range(3):
        for column in range(4):
            at = np.array([2.05 * column, 2.05 * row])
            parts.append(gear(at, 16 + 2 * ((row + column) % 3)))
            parts.append(
                revolve(np.array([[0, -0.1], [0.25, -0.1], [0.25, 0.4], [0, 0.4]]), 32, at)
            )
            for turn in 2 * np.pi * np.arange(6) / 6:
                bolt = at + 0.55 * np.array([np.cos(turn), np.sin(turn)])
                profile = np.array([[0, 0.26], [0.08, 0.26], [0.08, 0.34], [0, 0.34]])
                parts.append(revolve(profile, 12, bolt))
    return sf.subdivide(merged(parts), 0.12).mesh


def gear(axis, n_teeth):
    """A wheel with teeth and a hole, 0.25 thick."""
    n_around = 8 * n_teeth
    turns = 2 * np.pi * np.arange(n_around) / n_around
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    tooth = np.tile([0.85, 0.85, 0.87, 0.98, 1.0, 1.0, 0.98, 0.87], n_teeth)[:, None]
    rings = [(0.3, 0.0), (tooth, 0.0), (tooth, 0.25), (0.3, 0.25), (0.3, 0.0)]
    points = [np.insert(axis + radius * around, 2, z, axis=1) for radius, z in rings]
    return sf.Mesh(np.concatenate(points), ring_faces(len(rings), n_around))


def merged(parts):
    """One mesh of all parts."""
    starts = np.cumsum([0, *(part.n_vertices for part in parts[:-1])])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return sf.Mesh(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def terrain(n=220):
    """Ridges and valleys on a square of 100 by 100 meters, z up."""
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
    """The surface of a grid of points, shape (rows, columns, 3)."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = [np.stack(corners, axis=2).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return sf.Mesh(points.reshape(-1, 3), np.concatenate(faces))


def room():
    """Floor, two walls and furniture, in meters, z up."""
    parts = [corner(3.8, 4.0, 2.0)]
    parts += [box(1.5, 1.2, 0.70, 1.6, 0.9, 0.05)]  # a table
    parts += [box(x, y, 0, 0.06, 0.06, 0.7) for x in (1.55, 2.99) for y in (1.25, 1.99)]
    for x, y, back in ((1.7, 0.7, 0.7), (2.5, 0.7, 0.7), (2.1, 2.15, 2.55)):  # chairs
        parts += [box(x, y, 0.42, 0.45, 0.45, 0.05), box(x, back, 0.47, 0.45, 0.05, 0.45)]
        parts += [box(x + i, y + j, 0, 0.04, 0.04, 0.42) for i in (0, 0.41) for j in (0, 0.41)]
    parts += [box(0.05, 3.3, 0, 2.0, 0.65, 0.4), box(0.05, 3.75, 0.4, 2.0, 0.2, 0.4)]  # a sofa
    parts += [box(2.5, 3.55, 0, 1.2, 0.4, 1.7)]  # a cupboard
    return sf.subdivide(merged(parts), 0.06).mesh


def box(x, y, z, dx, dy, dz):
    """A box from a corner and its sides."""
    points = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[[a, b, c], [a, c, d]] for a, b, c, d in quads]
    return sf.Mesh([x, y, z] + points * [dx, dy, dz], np.reshape(faces, (-1, 3)))


def corner(dx, dy, dz):
    """A floor and the walls behind it."""
    points = [[0, 0, 0], [dx, 0, 0], [dx, dy, 0], [0, dy, 0], [0, 0, dz], [dx, dy, dz], [0, dy, dz]]
    faces = [[0, 1, 2], [0, 2, 3], [3, 2, 5], [3, 5, 6], [0, 3, 6], [0, 6, 4]]
    return sf.Mesh(points, faces)


def gyroid():
    """Part of a minimal surface, which divides space into two labyrinths."""
    import pyvista

    side = np.linspace(-np.pi, np.pi, 80)
    x, y, z = np.meshgrid(side, side, side, indexing="ij")
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    field = np.maximum(np.abs(field) - 0.4, np.hypot(np.hypot(x, y), z) - 3.0)
    volume = pyvista.ImageData(dimensions=field.shape)
    volume["field"] = field.ravel(order="F")
    return volume.contour([0.0], scalars="field").triangulate()


def knot(n_along=360, n_around=24):
    """A knotted tube of quads, thick and thin by turns."""
    along, around = np.meshgrid(*(np.arange(n) / n for n in (n_along, n_around)), indexing="ij")
    t, turn = 2 * np.pi * along, 2 * np.pi * around
    path = [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
    ahead = [np.cos(t) + 4 * np.cos(2 * t), 4 * np.sin(2 * t) - np.sin(t), -3 * np.cos(3 * t)]
    ahead = np.stack(ahead, axis=-1) / np.linalg.norm(ahead, axis=0)[..., np.newaxis]
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=-1, keepdims=True)
    radius = (0.42 + 0.16 * np.cos(9 * t))[..., np.newaxis]
    out = np.cos(turn)[..., np.newaxis] * side + np.sin(turn)[..., np.newaxis] * np.cross(
        ahead, side
    )
    points = np.stack(path, axis=-1) + radius * out
    i, j = np.arange(n_along)[:, np.newaxis], np.arange(n_around)
    next_i, next_j = (i + 1) % n_along, (j + 1) % n_around
    corners = [i * n_around + j, next_i * n_around + j, next_i * n_around + next_j,
               i * n_around + next_j]  # fmt: skip
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    return sf.PolygonMesh.of_faces(points.reshape(-1, 3), quads)


def body(n=12):
    """A wavy block of tetrahedra, six in each of n**3 cells."""
    side = np.linspace(-1, 1, n + 1)
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    # A ball out of a cube, with bumps.
    scale = np.maximum(np.abs(x), np.maximum(np.abs(y), np.abs(z)))
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


def points(n=60_000):
    """Points at random places on the bear, without faces, normals or an order."""
    mesh = sf.sample_mesh()
    rng = np.random.default_rng(0)
    areas = sf.build_face_graph(mesh).measures
    chosen = rng.choice(mesh.n_faces, n, p=areas / areas.sum())
    within = rng.dirichlet([1, 1, 1], n)
    return sf.PointCloud(np.einsum("pc,pcx->px", within, mesh.vertices[mesh.faces[chosen]]))


def rug(n=60_000):
    """Colored points on a rug that is not quite flat: stripes at its ends, diamonds between."""
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


def example_of_pyvista(name):
    """A mesh in the wheel of PyVista."""
    return folder_of("pyvista") / "examples" / name


def skeleton():
    """The skeleton in a scan of a frog, 500 by 470 by 136 voxels, that PyVista's wheel holds."""
    import pyvista

    volume = pyvista.read(example_of_pyvista("frog_tissues.vti"))
    bones = np.asarray(volume.active_scalars == 13, dtype=np.float32)
    volume.clear_data()
    volume["bones"] = bones
    volume = volume.resample(0.5)
    surface = volume.contour([0.5], scalars="bones").triangulate()
    return surface.smooth_taubin(n_iter=20, pass_band=0.1)


def cortex():
    """The left half of a mean human cortex (FreeSurfer's fsaverage5), in the wheel of nilearn."""
    path = folder_of("nilearn") / "datasets" / "data" / "fsaverage5" / "pial.left.gii.gz"
    with gzip.open(path) as file:
        arrays = ElementTree.parse(file).iter("DataArray")
    return tuple(gifti_array(array) for array in arrays)


def gifti_array(array):
    """Numbers of a GIFTI file: base64 of compressed little-endian data."""
    kind = {"NIFTI_TYPE_FLOAT32": "<f4", "NIFTI_TYPE_INT32": "<i4"}[array.get("DataType")]
    data = zlib.decompress(base64.b64decode(array.findtext("Data")))
    return np.frombuffer(data, kind).reshape(int(array.get("Dim0")), -1)


def robot(name):
    """A mesh of a robot in the wheel of gymnasium-robotics."""
    return folder_of("gymnasium_robotics") / "envs" / "assets" / name


def folder_of(package):
    """Where a package is, without importing it."""
    spec = find_spec(package)
    if spec is None:
        raise ModuleNotFoundError(package, name=package)
    return Path(spec.origin).parent


MESHES = {
    "bear": bear,
    "ant": lambda: example_of_pyvista("ant.ply"),
    "airplane": lambda: example_of_pyvista("airplane.ply"),
    "cortex": cortex,
    "skeleton": skeleton,
    "palm": lambda: robot("stls/hand/palm.stl"),
    "link": lambda: robot("kitchen_franka/franka_assets/meshes/visual/link6.stl"),
    "flange": flange,
    "gears": gears,
    "terrain": terrain,
    "scan": scan,
    "room": room,
    "gyroid": gyroid,
    "knot": knot,
    "body": body,
    "points": points,
    "rug": rug,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in MESHES.items():
        try:
            mesh = make()
            path = folder / f"{name}.{'vtu' if isinstance(mesh, sf.TetMesh) else 'ply'}"
            sf.write_mesh(path, mesh)
        except ModuleNotFoundError as error:
            print(f"{name}: left out, it needs {error.name}")
        except sf.MissingExtraError as error:
            print(f"{name}: left out, {error}")
        else:
            read = sf.read_cloud if isinstance(mesh, sf.PointCloud) else sf.read_mesh
            print(f"{name}: {read(path)}")


if __name__ == "__main__":
    main()
