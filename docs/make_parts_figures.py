"""Draw regions with ``"creases"`` and with the default, and spectral bands.

Usage: ``python docs/make_parts_figures.py PSB``. PSB is the folder of the Princeton benchmark.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
from research.embedding import spectral_embedding
from research.princeton import Benchmark
from shrink_images import IMAGES, read, save_small

import superfacets as sf

SIZE = (480, 420)
N_SEGMENTS = 150
N_SHADES = 24

MODELS = {
    "hand": (181, sf.View(azimuth=20, elevation=10)),
    "person": (1, sf.View(up="z", azimuth=20, elevation=5)),
}


def main(folder: Path) -> None:
    """Draw all pictures."""
    benchmark = Benchmark(folder)
    meshes = {name: (benchmark.load(number).mesh, view) for name, (number, view) in MODELS.items()}
    for name, (mesh, view) in meshes.items():
        of_creases = sf.segment(mesh, N_SEGMENTS, weights="creases").labels
        by_default = sf.segment(mesh, N_SEGMENTS).labels
        save_side_by_side(mesh, [of_creases, by_default], view, f"parts-{name}.png")
    mesh, view = meshes["hand"]
    bands = [shades(column) for column in spectral_embedding(mesh).T[:3]]
    save_side_by_side(mesh, bands, view, "parts-features.png")


def shades(values: np.ndarray) -> np.ndarray:
    """Divide the range of values into bands of equal width, and return the band of each value."""
    low, high = values.min(), values.max()
    bands = np.minimum((values - low) / (high - low) * N_SHADES, N_SHADES - 1).astype(np.int32)
    return np.unique(bands, return_inverse=True)[1].astype(np.int32)


def save_side_by_side(
    mesh: sf.Mesh, labels: list[np.ndarray], view: sf.View, file_name: str
) -> None:
    """Render one picture per label array, and save the pictures side by side in one file."""
    picture = Image.new("RGB", (SIZE[0] * len(labels), SIZE[1]))
    with TemporaryDirectory() as folder:
        path = Path(folder, "one.png")
        for i, some in enumerate(labels):
            sf.plot(mesh, some, output=path, size=SIZE, view=view)
            picture.paste(read(path, SIZE), (SIZE[0] * i, 0))
    save_small(picture, IMAGES / file_name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
