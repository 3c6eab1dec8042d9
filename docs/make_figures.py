"""Draw the pictures of the README and of the documentation: ``make figures``."""

import contextlib
import re
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory

import gallery_meshes
import numpy as np
from PIL import Image
from shrink_images import IMAGES, read, save_page

import superfacets as sf
from superfacets_show.backend import quiet_vtk

SIZE = (860, 688)
SMALL = (720, 540)
PLAIN = np.array([205, 197, 184])
DARK = np.array([150, 30, 40])
N_SEGMENTS = 150


def main() -> None:
    """Draw one picture per stage, and the first picture of the README."""
    IMAGES.mkdir(exist_ok=True)
    mesh = sf.sample_mesh()
    faces = sf.build_face_graph(mesh)
    rough = sf.segment(mesh, N_SEGMENTS, smooth=False)
    weights = sf.crease_weights(mesh, faces, rough.params["radius"])
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
    save(sf.plot(mesh, final.labels, size=(1080, 810)).image, "bear")
    draw_kinds()
    draw_tutorial()
    draw_slivers("howto-slivers")
    draw_cut("howto-cut")
    draw_plots(mesh, final.labels)


def draw_plots(mesh, labels):
    """Write two labelings side by side, and regions colored by their area."""
    coarse = sf.segment(mesh, 30).labels
    titles = ["150 regions", "30 regions"]
    plot = sf.plot(mesh, labels, compare=[coarse], titles=titles, size=(400, 440))
    save(plot.image, "howto-compare")
    save(sf.plot(mesh, labels, color_by="area", size=(480, 440)).image, "howto-values")


def draw(mesh, name, labels=None, colors=None):
    """Write one picture of the bear."""
    save(sf.plot(mesh, labels, colors=colors, size=SIZE).image, name)


def shades(values, exponent):
    """Return colors from light (lowest value) to dark (99.5th percentile and above)."""
    share = np.clip(values / np.quantile(values, 0.995), 0, 1)[:, None] ** exponent
    return np.round(PLAIN + share * (DARK - PLAIN)).astype(np.uint8)


def dearest_arc(graph):
    """Return the largest weight of the arcs of each face."""
    return np.maximum.reduceat(graph.weights, graph.offsets[:-1])


def dots(graph, seeds):
    """Return 1 for the faces around each seed, and 0 for all other faces."""
    is_near = np.zeros(graph.n_cells)
    for seed in seeds:
        distance = np.linalg.norm(graph.positions - graph.positions[seed], axis=1)
        is_near[distance < 0.025] = 1
    return is_near


def draw_slivers(name):
    """Write, side by side, a CAD part, its regions, and the regions of the subdivided part."""
    part = gallery_meshes.flange()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.SliverWarning)
        striped = sf.segment(part, N_SEGMENTS, weights=sf.Weights(eta_convex=0.2))
    fine = sf.subdivide(part, striped.params["radius"] / 4).mesh
    round_ones = sf.segment(fine, N_SEGMENTS, weights=sf.Weights(eta_convex=0.2))
    faces = np.arange(part.n_faces)
    plain = np.broadcast_to(PLAIN.astype(np.uint8), (part.n_faces, 3))
    style = {"view": sf.View(up="z", elevation=35), "size": (480, 400)}
    panels = [
        sf.plot(part, faces, colors=plain, border_width=1, **style).image,
        sf.plot(part, striped.labels, **style).image,
        sf.plot(fine, round_ones.labels, **style).image,
    ]
    save(np.concatenate(panels, axis=1), name)


def draw_cut(name):
    """Write, side by side, borders along edges and smooth borders."""
    mesh = sf.sample_mesh(6_000)
    labels = sf.segment(mesh, 60).labels
    style = {"size": (440, 440), "border_width": 2}
    panels = [
        sf.plot(mesh, labels, smooth_borders=is_smooth, **style).image
        for is_smooth in (False, True)
    ]
    save(np.concatenate(panels, axis=1), name)


def draw_kinds():
    """Write the four small pictures of the README: quads, tetrahedra, points, colors."""
    tilted = {angle: sf.View(up="z", elevation=angle) for angle in (40, 55)}
    mesh, body, cloud, rug = (
        getattr(gallery_meshes, name)() for name in ("knot", "body", "points", "rug")
    )
    save(sf.plot(mesh, sf.segment(mesh, 90), view=tilted[55], size=SMALL).image, "kind-quads")
    labels = sf.segment(body, 60)
    save(sf.plot(body, labels, view=tilted[40], size=SMALL, clip="-z").image, "kind-tetrahedra")
    labels = sf.segment(cloud, 150)
    save(sf.plot(cloud, labels, size=SMALL).image, "kind-points")
    view = sf.View(up="z", azimuth=0, elevation=60)
    labels = sf.segment(rug, 160, features="color")
    save(sf.plot(rug, labels, view=view, size=SMALL).image, "kind-colors")


def draw_tutorial():
    """Run the Python of the tutorial and write its picture."""
    page = Path(__file__).with_name("tutorial.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE))
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        with contextlib.redirect_stdout(None):
            exec(code, {})
        save(np.asarray(read(Path("part.png"), (720, 540))), "tutorial-part")


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
        save(plotter.screenshot(return_img=True), name)
        plotter.close()


def save(pixels, name):
    """Write a picture as WebP."""
    save_page(Image.fromarray(pixels), IMAGES / f"{name}.webp")


if __name__ == "__main__":
    main()
