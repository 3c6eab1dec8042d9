"""Update the screenshots of the studio: ``python docs/make_studio_pictures.py DATA``.

DATA is a folder with ``meshes/bunny.ply``, ``psb/off`` and ``rooms``. The script requires
Playwright and Chromium.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from browser_shots import PATIENCE, chromium, cloud, large_bear, montage
from playwright.sync_api import Page
from shrink_images import IMAGES, read, save_page

from superfacets import Mesh, write_mesh
from superfacets_studio.documents.document import Document
from superfacets_studio.labels.classes import default_classes

SIZE = {"width": 1280, "height": 800}
MODELS = ("125", "181", "281", "301", "397")
Line = list[tuple[int, int]]

# Lasso strokes on the bunny: the key of a class, and the corners of the lasso in pixels.
BUNNY: list[tuple[str, Line]] = [
    ("1", [(642, 263), (688, 119), (902, 124), (902, 236), (698, 279)]),
    ("2", [(489, 314), (552, 241), (645, 263), (698, 294), (718, 357), (591, 459), (494, 450)]),
    ("3", [(963, 625), (995, 591), (1063, 596), (1063, 737), (951, 737)]),
    ("4", [(572, 644), (727, 644), (893, 703), (893, 771), (572, 771)]),
]
ROOM = {1: "ball", 2: "shelf", 3: "box", 6: "floor", 9: "wall"}
LEFT_OUT = 5  # number of the object that stays unlabeled: a shelf
NAMES = ("ears", "head", "tail", "feet", "body")


@contextmanager
def studio(path: Path) -> Iterator[str]:
    """Start a studio for a path, and yield its address."""
    command = [sys.executable, "-m", "superfacets", "studio", str(path), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        words = process.stdout.readline().split()
        yield next(word for word in words if word.startswith("http://"))
        process.terminate()


def wait(page: Page) -> None:
    page.wait_for_function("() => window.studio && studio.ready", timeout=120_000)
    page.wait_for_timeout(1000)


def name_classes(page: Page) -> None:
    for number, name in enumerate(NAMES):
        page.locator(".class input[aria-label^='Name of']").nth(number).fill(name)
        page.keyboard.press("Enter")
        page.wait_for_timeout(500)


def lasso(page: Page, key: str, line: Line) -> None:
    page.keyboard.press(key)
    page.mouse.move(*line[0])
    page.mouse.down()
    for place in line[1:]:
        page.mouse.move(*place, steps=4)
        page.wait_for_timeout(150)
    page.mouse.up()
    page.wait_for_timeout(300)


def take(page: Page, path: Path) -> None:
    """Wait until smooth lines are drawn, and save a screenshot."""
    page.wait_for_timeout(1000)
    page.evaluate("studio.workbench.drawing.refine(true)")
    page.screenshot(path=path, timeout=PATIENCE)


def label_bunny(page: Page) -> None:
    name_classes(page)
    page.keyboard.press("l")
    for key, line in BUNNY:
        lasso(page, key, line)
    page.keyboard.press("5")
    page.keyboard.press("v")
    page.mouse.move(873, 479)
    page.mouse.down()
    page.mouse.move(922, 586, steps=4)
    page.wait_for_timeout(300)
    page.mouse.up()
    page.mouse.move(800, 459)


def label_largest(page: Page) -> None:
    """Three times, label the largest unlabeled region and a ring of cells around it."""
    for key in ("1", "2", "3"):
        for pressed in (key, "s", "Enter", "+", "Enter"):
            page.keyboard.press(pressed)
            page.evaluate("() => new Promise(requestAnimationFrame)")
            page.wait_for_timeout(200)
    page.locator("#canvas").focus()
    page.keyboard.press("Escape")
    page.keyboard.press("Home")
    page.mouse.move(360, 760)


def label_folder(page: Page) -> None:
    page.keyboard.press("PageDown")
    page.wait_for_timeout(3000)
    wait(page)
    label_largest(page)
    small = "[...document.querySelectorAll('#files img')].every(one => one.naturalWidth)"
    page.wait_for_function(f"() => {small}", timeout=120_000)


def storage(data: Path, place: Path) -> Path:
    """Return a room in which regions of all objects except a shelf have their true class."""
    room = np.load(data / "rooms" / "storage_d1.npz")
    path = place / "storage.ply"
    write_mesh(path, Mesh(room["vertices"].astype(float), room["faces"]))
    names = [ROOM.get(number, f"class {number}") for number in range(1, 10)]
    document = Document.open(path, None, 300, default_classes(names))
    labels, objects = document.revision.labels, room["instances"][room["faces"]][:, 1]
    classes = room["classes"].astype(int) + 1
    winners = [
        np.bincount(objects[labels == region]).argmax() for region in range(labels.max() + 1)
    ]
    for one in set(winners) - {LEFT_OUT}:
        cells = np.flatnonzero(np.isin(labels, np.flatnonzero(np.equal(winners, one))))
        number = np.count_nonzero(classes[:one] == classes[one]) + 1
        document.paint(cells.astype(np.uint32), int(classes[one]), objects=int(number))
    document.close()
    return path


def look_at_boxes(page: Page) -> None:
    page.locator("#canvas").focus()
    page.keyboard.press("Alt+3")
    page.keyboard.press("3")
    page.locator("#canvas").focus()
    for _ in range(4):
        page.keyboard.press("ArrowUp")
    page.mouse.move(900, 400, steps=3)


def main() -> None:
    data = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as place, chromium() as browser:
        bunny = Path(place) / "bunny.ply"
        shutil.copyfile(data / "meshes" / "bunny.ply", bunny)
        folder = Path(place) / "models"
        folder.mkdir()
        for name in MODELS:
            shutil.copyfile(data / "psb" / "off" / f"{name}.off", folder / f"{name}.off")
        rug, bear = Path(place) / "rug.ply", Path(place) / "bear.ply"
        write_mesh(rug, cloud())
        write_mesh(bear, large_bear())
        jobs: list[tuple[Path, Any, Any, str]] = [
            (bunny, label_bunny, "light", "studio.png"),
            (folder, label_folder, "dark", "studio-folder.png"),
            (rug, label_largest, "light", "rug.png"),
            (bear, label_largest, "dark", "bear.png"),
            (storage(data, Path(place)), look_at_boxes, "light", "studio-objects.png"),
        ]
        taken = []
        for path, label, scheme, name in jobs:
            with studio(path) as address:
                page = browser.new_page(
                    viewport=SIZE, color_scheme=scheme, reduced_motion="reduce"
                )  # fmt: skip
                page.set_default_timeout(PATIENCE)
                page.goto(address)
                wait(page)
                page.locator("#welcome-close").click()
                label(page)
                taken.append(Path(place) / name)
                take(page, taken[-1])
                page.close()
        for path in (*taken[:2], taken[4]):
            save_page(read(path), IMAGES / path.name)
        montage(taken[:4], "studio-four.webp")


if __name__ == "__main__":
    main()
