"""Draw the pictures of quality.md, of models of the Princeton benchmark that are in a folder."""

import sys
from pathlib import Path

import superfacets as sf
from superfacets.study.princeton import Benchmark
from superfacets.study.quality.measure import DEFAULT, PLAIN, VARIANTS

IMAGES = Path(__file__).parent / "images"
SIZE = (640, 520)
N_SEGMENTS = 150

MODELS = {
    "fourleg": (397, sf.View(azimuth=40, elevation=12)),
    "mech": (325, sf.View(azimuth=30, elevation=30)),
}


def main(folder: Path) -> None:
    """Draw each model with the paper's regions, and with those of the defaults."""
    benchmark = Benchmark(folder)
    for name, (number, view) in MODELS.items():
        mesh = benchmark.load(number).mesh
        for state, variant in ("before", PLAIN), ("after", DEFAULT):
            labels = sf.segment(mesh, N_SEGMENTS, **VARIANTS[variant]).labels
            path = IMAGES / f"quality-{name}-{state}.png"
            sf.render(mesh, labels, output=path, size=SIZE, view=view)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
