"""Draw the pictures of quality.md: ``python docs/make_quality_figures.py out/runs.csv meshes``.

``python -m research quality`` writes ``runs.csv``. ``meshes`` is a folder with bunny.ply, horse.ply
and fandisk.obj.
"""

import csv
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import gallery_meshes
import numpy as np
from PIL import Image
from research.quality.measure import CREASES, DEFAULT, PAPERS, segment_as
from research.quality.tables import means
from shrink_images import IMAGES, read, save_page

import superfacets as sf

N_SEGMENTS = 150

SMALL = (320, 270)
"""Size of each picture on the sheet, in pixels."""

SHAPES: dict[str, tuple[Callable[[Path], Any], int, sf.View]] = {
    "terrain": (lambda _: gallery_meshes.terrain(), 100, sf.View(up="z", elevation=45)),
    "room": (lambda _: voxel_room(), 150, sf.View(up="z", azimuth=130, elevation=35)),
    "bunny": (lambda folder: sf.read_mesh(folder / "bunny.ply"), 150, sf.View(azimuth=0)),
    "horse": (lambda folder: sf.read_mesh(folder / "horse.ply"), 150, sf.View(azimuth=65)),
    "fandisk": (lambda folder: sf.read_mesh(folder / "fandisk.obj"), 60, sf.View(azimuth=-50)),
    "bracket": (lambda _: bracket(), 30, sf.View(up="z", azimuth=40, elevation=30)),
}
"""For each name, the function that returns the mesh, the number of regions, and the view."""

KS = (50, 150, 300)
DEFAULTS = ("default, alpha 10", DEFAULT, "default, alpha 30", "default, alpha 40")
OF_CREASES = ("creases, alpha 10", CREASES, "creases, alpha 30", "creases, alpha 40")
CURVES = {
    "default, alpha 10 to 40": (DEFAULTS, "#1f5fa8"),
    'weights="creases", alpha 10 to 40': (OF_CREASES, "#c23b22"),
    "paper": ((PAPERS,), "#444444"),
    "paper's weights, smooth borders": (("plain, smooth",), "#8e5bb0"),
}


def main(runs: Path, meshes: Path) -> None:
    """Draw the sheet of six shapes, and the plot of the frontier."""
    save_sheet(meshes)
    with runs.open(newline="") as file:
        draw_frontier([row for row in csv.DictReader(file) if row["scale"] == "x1"])


def save_sheet(folder: Path) -> None:
    """Draw regions of six shapes, each with ``"creases"`` and with the default, on one sheet."""
    width, height = SMALL
    sheet = Image.new("RGB", (4 * width, 3 * height))
    with TemporaryDirectory() as scratch:
        path = Path(scratch, "one.png")
        for i, (make, k, view) in enumerate(SHAPES.values()):
            mesh = make(folder)
            for j, variant in enumerate((CREASES, DEFAULT)):
                labels = segment_as(variant, mesh, k).labels
                sf.plot(mesh, labels, output=path, size=SMALL, view=view)
                sheet.paste(read(path, SMALL), ((2 * (i % 2) + j) * width, i // 2 * height))
    save_page(sheet, IMAGES / "quality-shapes.webp")


def voxel_room() -> Any:
    """Return a floor, two walls and furniture, made by marching cubes on a grid of distances."""
    import pyvista

    spacing = 0.04
    x, y, z = np.meshgrid(*(np.arange(-0.2, high, spacing) for high in (4.0, 3.6, 2.0)),
                          indexing="ij")  # fmt: skip
    boxes = [(0.0, 0.0, -1.0, 9, 9, 1), (-1.0, -1.0, -1.0, 1, 9, 9), (-1.0, -1.0, -1.0, 9, 1, 9),
             (1.5, 1.3, 0.65, 1.4, 0.9, 0.1), (0.3, 2.2, 0.0, 0.7, 1.0, 0.45),
             (2.6, 0.1, 0.0, 0.9, 0.5, 1.5)]  # fmt: skip
    boxes += [(i, j, 0.0, 0.12, 0.12, 0.7) for i in (1.55, 2.73) for j in (1.35, 2.03)]
    field = np.full(x.shape, np.inf)
    for low_x, low_y, low_z, *sides in boxes:
        outside = [
            np.abs(at - low - side / 2) - side / 2
            for at, low, side in zip((x, y, z), (low_x, low_y, low_z), sides, strict=True)
        ]
        field = np.minimum(field, np.max(outside, axis=0))
    volume = pyvista.ImageData(dimensions=field.shape, spacing=(spacing,) * 3)
    volume["distance"] = field.ravel(order="F")
    return volume.contour([0.0], scalars="distance").triangulate()


def bracket() -> sf.Mesh:
    """Return a thin plate bent by 90 degrees, with small faces of about equal size."""
    profile = [[0, 0], [4, 0], [4, 0.25], [0.25, 0.25], [0.25, 3], [0, 3]]
    ends = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    points = np.concatenate([np.insert(np.array(profile), 1, y, axis=1) for y in (0.0, 2.5)])
    here, after = np.arange(6), (np.arange(6) + 1) % 6
    quads = np.stack([here, here + 6, after + 6, after], axis=1)
    sides = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = sf.Mesh(points, np.concatenate([ends, ends[:, ::-1] + 6, sides]))
    return sf.subdivide(mesh, 0.1).mesh


def draw_frontier(rows: Iterable[dict[str, str]]) -> None:
    """Plot UE over compactness, with one panel for each k."""
    from matplotlib.figure import Figure

    found = means(
        {"variant": row["variant"], "k": int(row["k"]), "ue": float(row["ue"]),
         "compactness": float(row["compactness"])}
        for row in rows
    )  # fmt: skip
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, len(KS))
    for k, axes in zip(KS, panels, strict=True):
        for label, (names, color) in CURVES.items():
            errors, compactnesses = zip(*(found[name, k] for name in names), strict=True)
            axes.plot(compactnesses, errors, "o-", color=color, label=label, markersize=4)
        axes.set(title=f"k = {k}", xlabel="compactness")
        axes.grid(color="#e4e4e4")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("undersegmentation error")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(IMAGES / "quality-frontier.png", dpi=110)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
