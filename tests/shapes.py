"""Small meshes and graphs whose segmentations, weights and arcs can be computed by hand."""

import itertools
import math

import numpy as np

from superfacets import CellGraph, Mesh, PointCloud, PolygonMesh, TetMesh, build_face_graph
from superfacets.graph.point_graph import find_point_graph
from superfacets.mesh.convert import as_cloud
from superfacets.tools.sample import split_in_four

# The six tetrahedra around the diagonal of the unit cube from corner 0 to corner 7.
AROUND = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]


def strip(n_faces):
    """Return a flat strip of right triangles with legs of 1:

    1---3---5
    |0/1|2/3| ...
    0---2---4
    """
    n_vertices = n_faces + 2
    vertices = [[v // 2, v % 2, 0] for v in range(n_vertices)]
    faces = [[f, f + 2, f + 1] if f % 2 == 0 else [f, f + 1, f + 2] for f in range(n_faces)]
    return Mesh(vertices, faces)


def cube():
    """Return the unit cube, normals outwards: faces 2s and 2s+1 are side s."""
    vertices = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return Mesh(vertices, [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])


def table():
    """Return a table of five boxes, 1.5 x 1 and 0.8 high, standing on four legs along z."""
    legs = [((x, y, 0), (x + 0.1, y + 0.1, 0.75)) for x in (0, 1.4) for y in (0, 0.9)]
    boxes = [((0, 0, 0.75), (1.5, 1, 0.8)), *legs]
    unit = cube()
    vertices = [np.array(low) + unit.vertices * np.subtract(high, low) for low, high in boxes]
    faces = [unit.faces + unit.n_vertices * box for box in range(len(boxes))]
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def inside_out_cube():
    return Mesh(cube().vertices, cube().faces[:, ::-1])


def fold(degrees):
    """Return two triangles on the edge from (0,0,0) to (0,2,0) whose normals differ by `degrees`.

    The first lies in the plane z = 0 on the side x < 0, its normal up. A positive angle lifts the
    other triangle: a valley, concave seen from above. A negative one lowers it: a ridge.
    """
    angle = math.radians(degrees)
    tip = [3 * math.cos(angle), 1, 3 * math.sin(angle)]
    return Mesh([[0, 0, 0], [0, 2, 0], [-3, 1, 0], tip], [[0, 1, 2], [1, 0, 3]])


def two_islands():
    """Return two strips of four faces, 10 apart in y."""
    one = strip(4)
    return Mesh(
        np.concatenate([one.vertices, one.vertices + [0, 10, 0]]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )


def together(meshes):
    """Return one mesh with the vertices and faces of all `meshes`, in order."""
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
    )


def gear(n_teeth, radius, height, center):
    """Return a closed gear with 16 faces per tooth and its axis along z."""
    n = 4 * n_teeth
    turns = 2 * math.pi * np.arange(n) / n
    radii = np.where(np.arange(n) % 4 < 2, radius, 0.85 * radius)
    rim = np.stack([radii * np.cos(turns), radii * np.sin(turns), np.zeros(n)], 1)
    vertices = np.concatenate([rim, rim + [0, 0, height], [[0, 0, 0], [0, 0, height]]])
    here, low, high = np.arange(n), np.full(n, 2 * n), np.full(n, 2 * n + 1)
    after = (here + 1) % n
    corners = [
        (here, after, n + after), (here, n + after, n + here), (after, here, low),
        (n + here, n + after, high),
    ]  # fmt: skip
    return Mesh(vertices + center, np.concatenate([np.stack(c, 1) for c in corners]))


def gears(n_gears=40, seed=0):
    """Return gears that do not touch, with radii from 0.1 to 3: most have almost no area."""
    rng = np.random.default_rng(seed)
    radii = 10 ** rng.uniform(-1, 0.5, n_gears)
    places = 8.0 * np.stack(np.unravel_index(rng.permutation(64)[:n_gears], (4, 4, 4)), 1)
    return together([
        gear(int(rng.integers(6, 20)), radius, 0.3 * radius, place)
        for radius, place in zip(radii, places, strict=True)
    ])  # fmt: skip


def moebius(n_quads=12):
    """Return a Moebius band: its last faces meet the first ones with the opposite orientation."""
    vertices = []
    for step in range(n_quads):
        turn = 2 * math.pi * step / n_quads
        for across in (-1, 1):
            r = 4 + across * math.cos(turn / 2)
            vertices.append([r * math.cos(turn), r * math.sin(turn), across * math.sin(turn / 2)])
    faces = []
    for step in range(n_quads):
        a, b = 2 * step, 2 * step + 1
        c, d = (a + 2, b + 2) if step < n_quads - 1 else (1, 0)
        faces += [[a, c, b], [b, c, d]]
    return Mesh(vertices, faces)


def bowtie():
    """Return two triangles that touch at a vertex only."""
    return Mesh([[0, 0, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2], [0, 3, 4]])


def fins(n_fins=3):
    """Return triangles around one edge they all share, from (0,0,0) to (0,0,1)."""
    turns = [2 * math.pi * fin / n_fins for fin in range(n_fins)]
    tips = [[math.cos(turn), math.sin(turn), 0.5] for turn in turns]
    return Mesh([[0, 0, 0], [0, 0, 1], *tips], [[0, 1, 2 + fin] for fin in range(n_fins)])


def crowded_sides(corners):
    """Return cells in groups of 64 that share a side of `corners` corners: too many arcs."""
    firsts = np.repeat(np.arange(4_400)[:, np.newaxis] * (64 + corners), 64, axis=0)
    tips = corners + np.tile(np.arange(64), 4_400)[:, np.newaxis]
    cells = firsts + np.concatenate([np.tile(np.arange(corners), (len(tips), 1)), tips], axis=1)
    return np.random.default_rng(0).random((int(cells.max()) + 1, 3)), cells


def slivers():
    """Return a proper triangle, a collinear one beside it, a point, and one with a corner twice."""
    vertices = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 1, 0], [5, 5, 5]]
    return Mesh(vertices, [[0, 1, 2], [2, 1, 3], [4, 4, 4], [0, 1, 1]])


def soup(mesh):
    """Return the same triangles, no two of which share a vertex."""
    return Mesh(
        mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3)
    )


def drilled_block(n_around=64, width=1.0, height=0.3, radius=0.3):
    """Return a block with a round hole, as CAD programs mesh it.

    Top and bottom are fans, and the hole is strips. The mesh is closed and has 4 n + 16 faces; n,
    the number of edges around the hole, is a multiple of 4.
    """
    turns = 2 * math.pi * (np.arange(n_around) + 0.5) / n_around
    rim = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    corners = width / 2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    outline = np.concatenate([rim, corners])
    n = len(outline)
    vertices = np.concatenate([np.insert(outline, 2, z, axis=1) for z in (0, height)])
    faces = []
    for i in range(n_around):
        j, corner = (i + 1) % n_around, n_around + 4 * i // n_around
        fan = [[i, corner, j]]
        if (i + 1) % (n_around // 4) == 0:  # go on to the next corner
            after = n_around + (corner - n_around + 1) % 4
            fan.append([j, corner, after])
            faces += [[corner, after, n + after], [corner, n + after, n + corner]]
        faces += [[c + n, b + n, a + n][::-1] for a, b, c in fan] + [f[::-1] for f in fan]
        faces += [[i, n + j, j], [i, n + i, n + j]]
    return Mesh(vertices, faces)


def rounded_slab(n_arc):
    """Return a flat prism over a rounded rectangle: 2 triangles per side and per strip."""
    turns = np.linspace(0, np.pi / 2, n_arc + 1)
    corners = [(4, 2), (-4, 2), (-4, -2), (4, -2)]
    arcs = [
        np.stack([x + np.cos(turns + k * np.pi / 2), y + np.sin(turns + k * np.pi / 2)], axis=1)
        for k, (x, y) in enumerate(corners)
    ]
    outline = np.concatenate(arcs)
    n = len(outline)
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    fan = np.stack([np.zeros(n - 2, int), i[1:-1], i[2:]], axis=1)
    sides = [np.stack([i, j, n + j], axis=1), np.stack([i, n + j, n + i], axis=1)]
    levels = [np.insert(outline, 2, z, axis=1) for z in (0, 3)]
    return Mesh(np.concatenate(levels), np.concatenate([fan[:, ::-1], n + fan, *sides]))


def revolved(profile, n_around, arc=2 * math.pi):
    """Return the surface that a profile of radius and height sweeps around z: squares cut in two.

    Normals point outward if the heights ascend.
    """
    radii, heights = np.transpose(profile)
    turns = np.linspace(0, arc, n_around + 1)[:, np.newaxis]
    heights = np.broadcast_to(heights, (len(turns), len(radii)))
    points = [radii * np.cos(turns), radii * np.sin(turns), heights]
    places = np.arange(len(turns) * len(radii)).reshape(len(turns), -1)
    a, b, c, d = places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return Mesh(np.stack(points, axis=-1).reshape(-1, 3), faces.reshape(-1, 3))


def filleted_boss(n_around=48):
    """Return a thin disk with a bore and a boss along z, and a fillet at the foot of the boss.

    One facet of the rim is wider than its neighbors, as between holes.
    """
    fillet = [(4 - math.sin(t), 1.1 - math.cos(t)) for t in np.linspace(0, math.pi / 2, 9)]
    mesh = revolved([(1, 6), (1, 0), (6, 0), (6, 0.1), *fillet, (3, 6), (1, 6)], n_around)
    vertices = mesh.vertices.copy()
    turns, radii = np.arctan2(vertices[:, 1], vertices[:, 0]), np.hypot(*vertices[:, :2].T)
    step = 2 * math.pi / n_around
    offsets = turns - 10.5 * step
    is_wide = (radii > 5) & (abs(offsets) < step)
    turns[is_wide] += 0.6 * step * np.sign(offsets[is_wide])
    vertices[:, 0], vertices[:, 1] = radii * np.cos(turns), radii * np.sin(turns)
    return Mesh(vertices, mesh.faces)


def bowl(n_around=24, thickness=0.1):
    """Return half a sphere with walls, closed and smooth except at its rim."""
    n_rings = n_around // 4
    heights = np.arange(1, n_rings + 1) / n_rings * np.pi / 2
    turns = np.arange(n_around) / n_around * 2 * np.pi
    shells = [
        radius * np.stack([np.sin(z) * np.cos(t), np.sin(z) * np.sin(t), -np.cos(z)], axis=-1)
        for radius in (1.0, 1.0 - thickness)
        for z, t in [np.meshgrid(heights, turns, indexing="ij")]
    ]
    rings = np.concatenate([shells[0], shells[1][::-1]])  # from outside to inside, over the rim
    vertices = np.concatenate([rings.reshape(-1, 3), [[0, 0, -1], [0, 0, thickness - 1]]])
    at = np.arange(2 * n_rings * n_around).reshape(-1, n_around)
    low, high = at[:-1], at[1:]
    after_low, after_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    first, last = at[0], at[-1]
    faces = [
        np.stack([low, after_low, high], axis=-1), np.stack([after_low, after_high, high], axis=-1),
        np.stack([np.roll(first, -1), first, np.full(n_around, at.size)], axis=-1),
        np.stack([last, np.roll(last, -1), np.full(n_around, at.size + 1)], axis=-1),
    ]  # fmt: skip
    return Mesh(vertices, np.concatenate([some.reshape(-1, 3) for some in faces]))


def bumpy_sheet(n=24, seed=0):
    """Return a square sheet of 2 n^2 faces with a ridge, a valley, and noise against ties."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    z = 0.3 * np.abs(x - 0.37) - 0.2 * np.abs(y - 0.61)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    vertices += rng.uniform(-0.15 / n, 0.15 / n, vertices.shape)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return Mesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def scan(seed):
    """Return noisy sheets with holes, specks, faces on non-manifold edges, and unused vertices."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(rng.integers(1, 4)):
        sheet = bumpy_sheet(int(rng.integers(3, 16)), int(rng.integers(1 << 20)))
        noise = rng.normal(size=sheet.vertices.shape) * rng.choice([0, 0.005, 0.03])
        kept = sheet.faces[rng.random(sheet.n_faces) < rng.choice([1, 0.97, 0.7])]
        parts.append(Mesh(sheet.vertices + noise + rng.uniform(-99, 99, 3), kept))
    for _ in range(rng.integers(0, 4)):
        parts.append(Mesh(cube().vertices * 0.01 + rng.uniform(-99, 99, 3), cube().faces))
    whole = together(parts)
    sides = whole.faces[rng.integers(0, whole.n_faces, rng.integers(0, 9)), :2]
    tips = whole.vertices[sides].mean(axis=1) + rng.normal(size=(len(sides), 3)) * 0.1
    unused = rng.normal(size=(rng.integers(0, 5), 3))
    vertices = np.concatenate([whole.vertices, tips, unused])
    more = np.column_stack([sides, whole.n_vertices + np.arange(len(sides))])
    order = rng.permutation(len(vertices))
    faces = np.argsort(order)[np.concatenate([whole.faces, more])]
    return Mesh(vertices[order], rng.permutation(faces))


def dumbbell(n_rings=31, n_around=14):
    """Return two blobs joined by a neck along x, open at both ends, narrowest at the ring x = 0."""
    x = np.linspace(-1, 1, n_rings)
    radii = 0.05 + 0.6 * np.abs(x) * np.sqrt(1.05 - x**2)
    turns = 2 * math.pi * np.arange(n_around) / n_around
    rings = np.stack(np.broadcast_arrays(x[:, None], np.cos(turns), np.sin(turns)), axis=-1)
    rings[..., 1:] *= radii[:, None, None]
    ring, around = np.meshgrid(np.arange(n_rings - 1), np.arange(n_around), indexing="ij")
    a, b = ring * n_around + around, ring * n_around + (around + 1) % n_around
    c, d = b + n_around, a + n_around
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return Mesh(rings.reshape(-1, 3), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def subdivided(mesh, times=1):
    """Return the mesh whose faces are cut into four, this many times."""
    arrays = (mesh.vertices, mesh.faces)
    for _ in range(times):
        arrays = split_in_four(*arrays)
    return Mesh(*arrays)


def column(n):
    """Return a column of unit cubes, of six tetrahedra each."""
    points = [[x, y, z] for z in range(n + 1) for y in (0, 1) for x in (0, 1)]
    return TetMesh(points, [[4 * i + v for v in tet] for i in range(n) for tet in AROUND])


def block(n):
    """Return a cube of n^3 unit cubes, of six tetrahedra each."""
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    vertices = np.stack(np.unravel_index(number.ravel(), number.shape), axis=1).astype(float)
    lists = []
    for axes in itertools.permutations(range(3)):
        steps = np.concatenate([[[0, 0, 0]], np.cumsum(np.eye(3, dtype=int)[list(axes)], axis=0)])
        lists.append([number[i : n + i, j : n + j, k : n + k].ravel() for i, j, k in steps])
    return TetMesh(vertices, np.transpose(lists, (2, 0, 1)).reshape(-1, 4))


def two_tets():
    """Return a tetrahedron at a corner of the unit cube, and a larger one behind its slope."""
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    return TetMesh(vertices, [[0, 1, 2, 3], [1, 2, 3, 4]])


def squares(n_x, n_y=None):
    """Return unit squares in the plane z = 0, row by row."""
    n_y = n_x if n_y is None else n_y
    points = [[x, y, 0] for y in range(n_y + 1) for x in range(n_x + 1)]
    lows = [y * (n_x + 1) + x for y in range(n_y) for x in range(n_x)]
    return PolygonMesh.of_faces(points, [[v, v + 1, v + n_x + 2, v + n_x + 1] for v in lows])


def flat(n_x, n_y=None):
    """Return the same squares, each cut into two triangles."""
    return halved(squares(n_x, n_y))


def halved(quads):
    """Return the mesh of triangles in which each square is cut from its first corner."""
    halves = quads.indices.reshape(-1, 4)[:, [0, 1, 2, 0, 2, 3]]
    return Mesh(quads.vertices, halves.reshape(-1, 3))


def row(*angles):
    """Return unit squares in a row, bent up by these angles (degrees) where two of them meet."""
    directions = np.radians(np.cumsum([0, *angles]))
    steps = np.stack([np.cos(directions), np.zeros(len(directions)), np.sin(directions)], axis=1)
    low = np.concatenate([[[0.0, 0.0, 0.0]], np.cumsum(steps, axis=0)])
    n = len(low)
    corners = [(i, i + 1, n + i + 1, n + i) for i in range(n - 1)]
    return PolygonMesh.of_faces(np.concatenate([low, low + [0, 1, 0]]), corners)


def quad_cube():
    """Return the unit cube of six squares: bottom, top, front, back, left and right."""
    sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return PolygonMesh.of_faces(cube().vertices, sides)


def house():
    """Return a square and an adjacent triangle of half its area."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]
    return PolygonMesh.of_faces(corners, [[0, 1, 2, 3], [3, 2, 4]])


def smallest_angles(mesh):
    """Return the smallest angle of each face, in radians."""
    corners = mesh.vertices[mesh.faces]
    one, other = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turn = np.linalg.norm(np.cross(one, other), axis=2)
    return np.arctan2(turn, np.sum(one * other, axis=2)).min(axis=1)


def unit_graph(mesh):
    graph = build_face_graph(mesh)
    return graph.with_weights(np.ones(graph.n_arcs))


def line_graph(weights, measures=None):
    """Return cells in a row at x = 0, 1, 2, ... with the given weights between them."""
    n = len(weights) + 1
    arcs = [(i, i + step) for i in range(n) for step in (-1, 1) if 0 <= i + step < n]
    return CellGraph(
        [[x, 0, 0] for x in range(n)], np.ones(n) if measures is None else measures,
        np.concatenate([[0], np.cumsum([sum(i == a for a, _ in arcs) for i in range(n)])]),
        np.array([b for _, b in arcs], dtype=np.int32), [weights[min(a, b)] for a, b in arcs],
    )  # fmt: skip


def random_graph(n, n_edges, seed, weight_values=None):
    """Return cells at random places with random undirected edges.

    Such graphs have many components and parallel arcs. Weights are drawn from `weight_values`; few
    values make many ties.
    """
    rng = np.random.default_rng(seed)
    ends = rng.integers(0, n, (n_edges, 2))
    ends = ends[ends[:, 0] != ends[:, 1]]
    weights = rng.uniform(0.1, 2, len(ends))
    if weight_values is not None:
        weights = rng.choice(weight_values, len(ends))
    sources = np.concatenate([ends[:, 0], ends[:, 1]])
    targets = np.concatenate([ends[:, 1], ends[:, 0]])
    order = np.argsort(sources, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=n))])
    measures = rng.uniform(0, 1, n) * (rng.uniform(size=n) > 0.1)
    positions = rng.uniform(-1, 1, (n, 3))
    return CellGraph(
        positions, measures, offsets, targets[order], np.concatenate([weights, weights])[order]
    )


def random_one_way_graph(n, n_arcs, seed):
    """Return a graph like `random_graph`, but with each arc in one direction only."""
    rng = np.random.default_rng(seed)
    sources = np.sort(rng.integers(0, n, n_arcs))
    return CellGraph(
        np.round(rng.uniform(-1, 1, (n, 3)), 1),  # rounded: many distances are equal
        rng.uniform(0, 1, n),
        np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=n))]),
        rng.integers(0, n, n_arcs),
        rng.choice([0.5, 1.0, 2.0], n_arcs),
    )


def count_pieces(graph, labels):
    """Return the number of connected pieces of all regions together."""
    labels = np.asarray(labels)
    parent = list(range(len(labels)))

    def root(cell):
        while parent[cell] != cell:
            parent[cell] = parent[parent[cell]]
            cell = parent[cell]
        return cell

    sources = np.repeat(np.arange(len(labels)), np.diff(graph.offsets))
    inside = labels[sources] == labels[graph.neighbors]
    for a, b in zip(sources[inside].tolist(), graph.neighbors[inside].tolist(), strict=True):
        parent[root(a)] = root(b)
    return sum(root(cell) == cell for cell in range(len(labels)))


def estimated_normals(points, viewpoint=None):
    """Return the normals that `segment` estimates for a cloud."""
    cloud = as_cloud(points)
    viewpoints = cloud.viewpoints if viewpoint is None else viewpoint
    return find_point_graph(PointCloud(cloud.points, None, None, cloud.axes, viewpoints), 2).normals


def same_regions(one, two):
    """Return whether two labelings differ only in their numbers."""
    pairs = np.unique(np.stack([one, two]), axis=1).shape[1]
    return pairs == one.max() + 1 == two.max() + 1
