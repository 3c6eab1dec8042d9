"""Draw the pictures of the README and of the documentation: ``make figures``."""

import warnings
from pathlib import Path

import numpy as np
from gallery_meshes import flange

import superfacets as sf
from superfacets.pictures.backend import quiet_vtk

IMAGES = Path(__file__).parent / "images"
SIZE = (860, 688)
PLAIN = np.array([205, 197, 184])
DARK = np.array([150, 30, 40])
N_SEGMENTS = 150


def main() -> None:
    """Draw one picture per stage, and the one that the README begins with."""
    IMAGES.mkdir(exist_ok=True)
    mesh = sf.sample_mesh()
    faces = sf.build_face_graph(mesh)
    rough = sf.segment(mesh, N_SEGMENTS, smooth=False)
    weights = sf.crease_weights(mesh, faces, rough.params["expected_radius"])
    graph = faces.with_weights(weights)
    seeds = sf.place_seeds(graph, N_SEGMENTS)
    first = sf.classify(graph, seeds)
    final = sf.segment(mesh, N_SEGMENTS)

    draw(mesh, "stage0-mesh")
    draw_arcs(sf.sample_mesh(6_000), "stage1-face-graph")
    draw(mesh, "stage2-weights", colors=shades(dearest_arc(graph), 1.0))
    draw(mesh, "stage3-seeding", colors=shades(dots(graph, seeds), 1.0))
    draw(mesh, "stage4a-classify", first.labels, colors=shades(first.distances, 1.0))
    draw(mesh, "stage4b-update", rough.labels)
    draw(mesh, "stage5-regions", final.labels)
    sf.render(mesh, final.labels, output=IMAGES / "bear.png", size=(1080, 810))
    draw_slivers("howto-slivers")
    draw_cut("howto-cut")
    draw_plots(mesh, final.labels)


def draw_plots(mesh, labels):
    """Write two labelings side by side, and regions colored by their area."""
    coarse = sf.segment(mesh, 30).labels
    titles = ["150 regions", "30 regions"]
    style = {"size": (400, 440), "output": IMAGES / "howto-compare.png"}
    sf.plot(mesh, labels, compare=[coarse], titles=titles, **style)
    style = {"size": (480, 440), "output": IMAGES / "howto-values.png"}
    sf.plot(mesh, labels, color_by="area", **style)


def draw(mesh, name, labels=None, colors=None):
    """Write one picture of the bear."""
    sf.render(mesh, labels, colors=colors, output=IMAGES / f"{name}.png", size=SIZE)


def shades(values, exponent):
    """Colors from plain (the lowest value) to dark (the highest, outliers aside)."""
    share = np.clip(values / np.quantile(values, 0.995), 0, 1)[:, None] ** exponent
    return np.round(PLAIN + share * (DARK - PLAIN)).astype(np.uint8)


def dearest_arc(graph):
    """The largest weight among the arcs of each face."""
    return np.maximum.reduceat(graph.weights, graph.offsets[:-1])


def dots(graph, seeds):
    """1 for the faces around each seed, 0 for others."""
    is_near = np.zeros(graph.n_cells)
    for seed in seeds:
        distance = np.linalg.norm(graph.positions - graph.positions[seed], axis=1)
        is_near[distance < 0.025] = 1
    return is_near


def draw_slivers(name):
    """Write, side by side, a CAD part, its regions, and those of the subdivided part."""
    part = flange()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.SliverWarning)
        striped = sf.segment(part, N_SEGMENTS, eta_convex=0.2)
    fine = sf.subdivide(part, striped.params["expected_radius"] / 4).mesh
    round_ones = sf.segment(fine, N_SEGMENTS, eta_convex=0.2)
    faces = np.arange(part.n_faces)
    plain = np.broadcast_to(PLAIN.astype(np.uint8), (part.n_faces, 3))
    style = {"view": sf.View(up="z", elevation=35), "size": (480, 400)}
    panels = [
        sf.render(part, faces, colors=plain, border_width=1, **style),
        sf.render(part, striped.labels, **style),
        sf.render(fine, round_ones.labels, **style),
    ]
    write_row(panels, name)


def draw_cut(name):
    """Write, side by side, borders along edges and smooth ones."""
    mesh = sf.sample_mesh(6_000)
    labels = sf.segment(mesh, 60).labels
    style = {"size": (440, 440), "border_width": 2}
    panels = [
        sf.render(mesh, labels, smooth_borders=is_smooth, **style) for is_smooth in (False, True)
    ]
    write_row(panels, name)


def write_row(panels, name):
    """Write pictures side by side."""
    from PIL import Image

    pixels = np.concatenate([np.asarray(panel) for panel in panels], axis=1)
    Image.fromarray(pixels).quantize(128).save(IMAGES / f"{name}.png", optimize=True)


def draw_arcs(mesh, name):
    """Write a picture of an ear with the graph of its faces."""
    import pyvista

    graph = sf.build_face_graph(mesh)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    ends = np.stack([sources, graph.neighbors], axis=1)[sources < graph.neighbors]
    lines = np.insert(ends, 0, 2, axis=1)
    with quiet_vtk():
        plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
        surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
        plotter.add_mesh(surface, color=PLAIN / 255, show_edges=True, edge_color="#948c80")
        lifted = graph.positions + 0.006 * surface.compute_normals().face_normals
        arcs = pyvista.PolyData(lifted, lines=lines.ravel())
        plotter.add_mesh(arcs, color=DARK / 255, line_width=3)
        plotter.add_points(lifted, color=DARK / 255, point_size=9, render_points_as_spheres=True)
        plotter.enable_anti_aliasing("ssaa")
        plotter.camera_position = [(1.6, 2.0, 3.2), (0.46, 1.3, 0.1), (0, 1, 0)]
        plotter.camera.zoom(5)
        plotter.screenshot(IMAGES / f"{name}.png")
        plotter.close()


if __name__ == "__main__":
    main()
