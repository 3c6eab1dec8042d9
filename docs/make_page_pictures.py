"""Update the screenshots of `superfacets.view`: ``python docs/make_page_pictures.py DATA``.

DATA is a folder with ``meshes/bunny.ply`` and ``psb``. The script requires Playwright and Chromium.
"""

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from browser_shots import PATIENCE, chromium, cloud, large_bear, montage
from playwright.sync_api import Browser

import superfacets as sf
from superfacets import Page

SIZE = {"width": 760, "height": 500}
MODEL = "397"


@dataclass
class Shot:
    """A page, and the actions on the page before the screenshot."""

    name: str
    page: Page
    scheme: str = "light"
    coloring: int = 0  # index in the list of colorings
    level: int = 0
    pointer: tuple[int, int] | None = None


def shots(data: Path) -> Iterator[Shot]:
    bunny = sf.read_mesh(data / "meshes" / "bunny.ply")
    levels = sf.hierarchy(bunny, [500, 150, 50])
    yield Shot("bunny", sf.view(bunny, levels, title="Stanford bunny"), level=1, pointer=(545, 330))
    model = sf.read_mesh(data / "psb" / "off" / f"{MODEL}.off")
    truth = np.loadtxt(data / "psb" / "seg" / "Benchmark" / MODEL / f"{MODEL}_0.seg", dtype=int)
    labels = sf.segment(model, 150).labels
    page = sf.view(model, labels, ground_truth=truth, title=f"Princeton benchmark, {MODEL}")
    yield Shot("model", page, "dark", coloring=1)
    points = cloud()
    labels = sf.segment(points, 60).labels
    page = sf.view(points, labels, camera=sf.View(elevation=50), title="A rug of points")
    yield Shot("cloud", page)
    bear = large_bear()
    labels = sf.segment(bear, 2000).labels
    heights = bear.vertices[bear.faces, 1].mean(axis=1)
    page = sf.view(bear, labels, features={"height": heights}, title="A bear of a million faces")
    yield Shot("million", page, "dark", coloring=1)


def take(browser: Browser, shot: Shot, path: Path) -> None:
    """Open the page from disk and save a screenshot."""
    file = path.with_suffix(".html")
    shot.page.save(file)
    page = browser.new_page(viewport=SIZE, color_scheme=shot.scheme)
    page.set_default_timeout(PATIENCE)
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-state='ready']", state="attached")
    page.evaluate(f"superfacets.setColoring({shot.coloring}); superfacets.setLevel({shot.level})")
    if shot.pointer is not None:
        page.mouse.move(*shot.pointer)
        page.wait_for_selector("#tip:not([hidden])", state="attached")
    page.evaluate("superfacets.drawing.rest()")
    page.wait_for_timeout(1000)
    page.screenshot(path=path, timeout=PATIENCE)
    page.close()


def main() -> None:
    data = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as place, chromium() as browser:
        folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(place)
        taken = []
        for shot in shots(data):
            taken.append(folder / f"{shot.name}.png")
            take(browser, shot, taken[-1])
        montage(taken, "page.webp")


if __name__ == "__main__":
    main()
