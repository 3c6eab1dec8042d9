"""Draw the pictures of quality.md: ``python docs/make_quality_figures.py psb out/runs.csv``.

``psb`` is the folder of the Princeton benchmark, ``runs.csv`` a file of ``superfacets quality``.
"""

import csv
import sys
from collections.abc import Iterable
from pathlib import Path

import gallery_meshes
import numpy as np
from make_parts_figures import save_side_by_side
from shrink_images import IMAGES

import superfacets as sf
from superfacets.study.princeton import Benchmark
from superfacets.study.quality.measure import CREASES, DEFAULT, PAPERS, PLAIN, VARIANTS
from superfacets.study.quality.tables import means

SIZE = (640, 520)
N_SEGMENTS = 150

MODELS = {
    "fourleg": (397, sf.View(azimuth=40, elevation=12)),
    "mech": (325, sf.View(azimuth=30, elevation=30)),
}

KS = (50, 150, 300)
DEFAULTS = ("default, alpha 10", DEFAULT, "default, alpha 30", "default, alpha 40")
OF_CREASES = ("creases, alpha 10", CREASES, "creases, alpha 30", "creases, alpha 40")
CURVES = {
    "default, alpha 10 to 40": (DEFAULTS, "#1f5fa8"),
    'weights="creases", alpha 10 to 40': (OF_CREASES, "#c23b22"),
    "paper": ((PAPERS,), "#444444"),
    "paper's weights, smooth borders": (("plain, smooth",), "#8e5bb0"),
}


def main(folder: Path, runs: Path) -> None:
    """Draw models with the paper's regions and by default, a plain, and the frontier."""
    benchmark = Benchmark(folder)
    for name, (number, view) in MODELS.items():
        mesh = benchmark.load(number).mesh
        for state, variant in ("before", PLAIN), ("after", DEFAULT):
            labels = sf.segment(mesh, N_SEGMENTS, **VARIANTS[variant]).labels
            path = IMAGES / f"quality-{name}-{state}.png"
            sf.render(mesh, labels, output=path, size=SIZE, view=view)
    save_plain()
    with runs.open(newline="") as file:
        draw_frontier([row for row in csv.DictReader(file) if row["scale"] == "x1"])


def save_plain() -> None:
    """Draw a plain on a regular grid, with creases alone and by default."""
    rows, columns = np.mgrid[:160, :160].astype(float)
    mesh = gallery_meshes.grid(np.stack([rows, columns, 0 * rows], axis=2))
    variants = (VARIANTS[CREASES], VARIANTS[DEFAULT])
    labels = [sf.segment(mesh, N_SEGMENTS, **keywords).labels for keywords in variants]
    view = sf.View(up="z", azimuth=0, elevation=89)
    save_side_by_side(mesh, labels, view, "quality-grid.png")


def draw_frontier(rows: Iterable[dict[str, str]]) -> None:
    """Draw UE over compactness, one panel for each k."""
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
    main(Path(sys.argv[1]), Path(sys.argv[2]))
