"""Take the pictures of the studio anew: ``python docs/make_studio_pictures.py DATA``.

DATA is a folder with ``meshes/bunny.ply`` and ``psb/off``. Playwright and Chromium are needed.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from browser_shots import PATIENCE, chromium, cloud, large_bear, montage
from playwright.sync_api import Page
from shrink_images import IMAGES, read, save_small

from superfacets import write_mesh

SIZE = {"width": 1280, "height": 800}
MODELS = ("125", "181", "281", "301", "397")
Line = list[tuple[int, int]]

# What the lasso goes around on the bunny, by class.
BUNNY: list[tuple[str, Line]] = [
    ("1", [(612, 248), (660, 100), (880, 105), (880, 220), (670, 265)]),
    ("2", [(455, 300), (520, 225), (615, 248), (670, 280), (690, 345), (560, 450), (460, 440)]),
    ("3", [(942, 620), (975, 585), (1045, 590), (1045, 735), (930, 735)]),
    ("4", [(540, 640), (700, 640), (870, 700), (870, 770), (540, 770)]),
]
NAMES = ("ears", "head", "tail", "feet", "body")


@contextmanager
def studio(path: Path) -> Iterator[str]:
    """Serve a path; gives the address."""
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
        page.locator("input[aria-label^='Name of']").nth(number).fill(name)
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
    """Save a picture with smooth lines, however long they take here."""
    page.wait_for_timeout(1000)
    page.evaluate("studio.desk.drawing.refine(true)")
    page.screenshot(path=path, timeout=PATIENCE)


def label_bunny(page: Page) -> None:
    name_classes(page)
    page.keyboard.press("l")
    for key, line in BUNNY:
        lasso(page, key, line)
    page.keyboard.press("5")
    page.keyboard.press("v")
    page.mouse.move(850, 470)
    page.mouse.down()
    page.mouse.move(900, 580, steps=4)
    page.wait_for_timeout(300)
    page.mouse.up()
    page.mouse.move(775, 450)


def label_largest(page: Page) -> None:
    """Give the largest region without a class one, with a ring around it; three times."""
    for key in ("1", "2", "3"):
        for pressed in (key, "s", "Enter", "+", "Enter"):
            page.keyboard.press(pressed)
            page.evaluate("() => new Promise(requestAnimationFrame)")
            page.wait_for_timeout(200)
    page.locator("#canvas").focus()
    page.keyboard.press("Escape")
    page.keyboard.press("Home")
    page.mouse.move(300, 760)


def label_folder(page: Page) -> None:
    page.keyboard.press("PageDown")
    page.wait_for_timeout(3000)
    wait(page)
    label_largest(page)
    small = "[...document.querySelectorAll('#files img')].every(one => one.naturalWidth)"
    page.wait_for_function(f"() => {small}", timeout=120_000)


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
                label(page)
                taken.append(Path(place) / name)
                take(page, taken[-1])
                page.close()
        for path in taken[:2]:
            save_small(read(path), IMAGES / path.name)
        montage(taken, "studio-four.png")


if __name__ == "__main__":
    main()
