"""Draw regions by default and within parts, side by side, the features they are made of, a cup.

``python docs/make_parts_figures.py psb fandisk.obj``: the folder of the Princeton benchmark, and
further meshes, whose pictures get their names.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
from shrink_images import IMAGES, read, save_small

import superfacets as sf
from superfacets.study.princeton import Benchmark

SIZE = (480, 420)
N_SEGMENTS = 150
N_SHADES = 24

MODELS = {
    "hand": (181, sf.View(azimuth=20, elevation=10)),
    "horse": (397, sf.View(azimuth=40, elevation=12)),
    "person": (1, sf.View(up="z", azimuth=20, elevation=5)),
    "machine": (329, sf.View(azimuth=30, elevation=30)),
}
FURTHER = sf.View(azimuth=30, elevation=30)


def main(folder: Path, further: list[Path]) -> None:
    """Draw all pictures."""
    benchmark = Benchmark(folder)
    meshes = {name: (benchmark.load(number).mesh, view) for name, (number, view) in MODELS.items()}
    meshes |= {path.stem: (sf.read_mesh(path), FURTHER) for path in further}
    for name, (mesh, view) in meshes.items():
        by_default = sf.segment(mesh, N_SEGMENTS).labels
        within_parts = sf.segment(mesh, N_SEGMENTS, **sf.PARTS).labels
        save_side_by_side(mesh, [by_default, within_parts], view, f"parts-{name}.png")
    mesh, view = meshes["hand"]
    thickness, first, second = sf.shape_diameter(mesh), *sf.spectral_embedding(mesh).T[:2]
    bands = [shades(np.log(thickness)), shades(first), shades(second)]
    save_side_by_side(mesh, bands, view, "parts-features.png")
    save_cup(benchmark.load(29).mesh)


def save_cup(mesh: sf.Mesh) -> None:
    """Draw a hollow shape as if it were solid, and by default."""
    by_default = sf.segment(mesh, N_SEGMENTS)
    radius = by_default.params["expected_radius"]
    weights = sf.crease_weights(mesh, sf.build_face_graph(mesh), radius, hollows=False)
    labels = [sf.segment(mesh, N_SEGMENTS, weights=weights).labels, by_default.labels]
    save_side_by_side(mesh, labels, sf.View(azimuth=30, elevation=35), "hollows-cup.png")


def shades(values: np.ndarray) -> np.ndarray:
    """Bands of equal width, as labels."""
    low, high = values.min(), values.max()
    bands = np.minimum((values - low) / (high - low) * N_SHADES, N_SHADES - 1).astype(np.int32)
    return np.unique(bands, return_inverse=True)[1].astype(np.int32)


def save_side_by_side(
    mesh: sf.Mesh, labels: list[np.ndarray], view: sf.View, file_name: str
) -> None:
    """Render one picture for each labels, and keep them as one."""
    picture = Image.new("RGB", (SIZE[0] * len(labels), SIZE[1]))
    with TemporaryDirectory() as folder:
        path = Path(folder, "one.png")
        for i, some in enumerate(labels):
            sf.render(mesh, some, output=path, size=SIZE, view=view)
            picture.paste(read(path, SIZE), (SIZE[0] * i, 0))
    save_small(picture, IMAGES / file_name)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
