"""Functions shared by the scripts that take screenshots in a browser."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gallery_meshes
from PIL import Image
from playwright.sync_api import Browser, sync_playwright
from shrink_images import IMAGES, read, save_page

import superfacets as sf

OPTIONS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
PATIENCE = 300_000  # timeout in milliseconds: software draws a million faces slowly
N_FACES = 963_520  # number of faces of the large bear
GAP = 8  # pixels between the pictures of a montage
WIDTH = 1000  # width of a montage in pixels, to keep the file small


@contextmanager
def chromium() -> Iterator[Browser]:
    """Return Chromium without a window and with software rendering."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        yield browser
        browser.close()


def large_bear() -> sf.Mesh:
    return sf.sample_mesh(N_FACES)


def cloud() -> sf.PointCloud:
    """Return a rug of colored points."""
    rug: sf.PointCloud = gallery_meshes.rug()
    return rug


def montage(shots: list[Path], name: str) -> None:
    """Combine four pictures of the same size into one picture, two by two."""
    pictures = [read(path) for path in shots]
    width, height = pictures[0].size
    sheet = Image.new("RGB", (2 * width + GAP, 2 * height + GAP), "#8a8f98")
    for i, picture in enumerate(pictures):
        row, column = divmod(i, 2)
        sheet.paste(picture, (column * (width + GAP), row * (height + GAP)))
    small = sheet.resize((WIDTH, sheet.height * WIDTH // sheet.width), Image.Resampling.LANCZOS)
    save_page(small, IMAGES / name)
    print(f"{name}: {(IMAGES / name).stat().st_size:,} bytes")
