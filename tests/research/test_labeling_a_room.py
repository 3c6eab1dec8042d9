"""A scan of a room is labeled completely in the studio, by the rules of thumb of the guide."""

import json
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from superfacets import Mesh, write_mesh

studio_page = pytest.importorskip("studio.browser.studio_page")

ROOM = Path(__file__).resolve().parents[3] / "shared" / "data" / "rooms" / "office_d1.npz"
NAMES = ["floor", "wall", "wall", "table", "chair", "cabinet", "bookshelf", "bin", "cup", "bear"]
NAMES += ["lamp", "sofa", "ball", "bust"]  # class of each object in the file
CLASSES = list(dict.fromkeys(NAMES))
CUP = NAMES.index("cup")  # ten faces, which share a region with the table
STEP = 5  # distance of the places at which the labeler looks, in pixels
MARGIN = 45  # height of the strips at the top and the bottom that buttons and messages cover

LOOK = """([step, margin]) => {
    const { cells, width, height } = studio.workbench.picker.cellsSeen();
    const rows = [];
    for (let y = margin; y < height - margin; y += step) {
        const row = [];
        for (let x = 0; x < width; x += step) row.push(cells[(height - 1 - y) * width + x] | 0);
        rows.push(row);
    }
    return rows;
}"""
IN_VIEW = """cells => cells.filter((cell) => {
    const place = studio.screenOf(cell);
    return place && place.x > 20 && place.y > 50;
}).length"""


class Labeler:
    """Somebody who sees to which object each region belongs, and whose strokes are counted."""

    def __init__(self, tab, truth):
        self.tab, self.truth, self.n_strokes = tab, truth, 0
        self.labels = tab.labels()
        counts = np.zeros((self.labels.max() + 1, len(NAMES)))
        np.add.at(counts, (self.labels, truth), 1)
        self.owners = counts.argmax(axis=1)  # object that has most of each region

    def choose(self, owner):
        number = CLASSES.index(NAMES[owner])
        self.tab.locator(".class [type=radio]").nth(number).click()

    def picture(self):
        """Return the region at each place of a grid, or -1."""
        cells = np.array(self.tab.evaluate(LOOK, [STEP, MARGIN]))
        return np.where(cells >= 0, self.labels[cells], -1)

    def fill(self, owner):
        """Press F over the largest region of an object in view."""
        self.choose(owner)
        seen = self.picture()
        sizes = np.bincount(seen[(seen >= 0) & (self.owners[seen] == owner)])
        places = np.argwhere(seen == sizes.argmax())
        middle = places[np.abs(places - places.mean(axis=0)).sum(axis=1).argmin()]
        x, y = self.tab._on_page(*place_of(middle))
        for shift in (1, 0):
            self.tab.page.mouse.move(x + shift, y)
        self.tab.until("studio.workbench.hoveredCell >= 0")
        self.tab.press("f")
        self.tab.wait_for_status("similar region")
        self.n_strokes += 1

    def paint_next(self):
        """Go to the next unlabeled region, and drag over its object; False if nothing is left."""
        tab = self.tab
        tab.press("s")
        if tab.status.startswith("Every region has a class"):
            return False
        region = tab.evaluate("studio.cursor()")
        owner = self.owners[region]
        self.choose(owner)
        self.zoom_out(owner)
        seen = self.picture()
        starts = np.argwhere(seen == region)
        if len(starts):
            bare = set(self.labels[tab.classes() == 0].tolist())
            is_open = (seen >= 0) & (self.owners[seen] == owner)
            path = tour(seen, is_open, tuple(starts[len(starts) // 2].tolist()), bare)
            tab.drag(*[place_of(spot) for spot in path])
        else:
            tab.locator("#canvas").focus()
            tab.press("Enter")
        self.n_strokes += 1
        tab.settled()
        return True

    def zoom_out(self, owner):
        """Zoom out until the whole object is in view."""
        cells = np.flatnonzero(self.truth == owner)
        cells = cells[:: max(1, len(cells) // 60)].tolist()
        for _ in range(12):
            if self.tab.evaluate(IN_VIEW, cells) > 0.97 * len(cells):
                return
            self.tab.press("Shift+I")

    def dab(self, owner):
        """Go close to a small object, and brush its cells with one stroke of the smallest brush."""
        tab, cells = self.tab, np.flatnonzero(self.truth == owner).tolist()
        self.choose(owner)
        tab.press("Home", "u", "k", "b", *"------------")
        for _ in range(6):
            x, y = tab._on_page(*np.mean(self.places(cells), axis=0).tolist())
            tab.page.mouse.dblclick(x, y, button="right")
            tab.evaluate("new Promise(requestAnimationFrame)")
        tab.drag(*sorted(self.places(cells)))
        self.n_strokes += 1
        tab.settled()

    def places(self, cells):
        found = self.tab.evaluate("cells => cells.map(studio.screenOf)", cells)
        return [(place["x"], place["y"]) for place in found]


def place_of(spot):
    """Return the position in pixels of a row and a column of a picture."""
    return float(STEP * spot[1]), float(MARGIN + STEP * spot[0])


def tour(seen, is_open, start, wanted):
    """Return spots of a drag from `start` over all wanted regions that it can reach."""
    path, left = [start], wanted - {int(seen[start])}
    while leg := shortest_way(seen, is_open, path[-1], left):
        path += leg
        left = left - {int(seen[leg[-1]])}
    kept, last = [start], 0
    while last + 1 < len(path):  # leave out spots between which a straight line stays on the object
        ahead = range(min(len(path) - 1, last + 25), last, -1)
        last = next((i for i in ahead if is_clear(path[last], path[i], is_open)), last + 1)
        kept.append(path[last])
    return kept if len(kept) > 1 else [start, start]


def shortest_way(seen, is_open, start, wanted):
    """Return the open spots from `start` to the nearest wanted region, [] if there is none."""
    before, queue = {start: start}, deque([start])
    while queue:
        spot = queue.popleft()
        if int(seen[spot]) in wanted:
            way = [spot]
            while before[way[-1]] != start:
                way.append(before[way[-1]])
            return way[::-1]
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            new = spot[0] + down, spot[1] + right
            is_inside = 0 <= new[0] < seen.shape[0] and 0 <= new[1] < seen.shape[1]
            if is_inside and is_open[new] and new not in before:
                before[new] = spot
                queue.append(new)
    return []


def is_clear(one, other, is_open):
    n = 2 * max(abs(one[0] - other[0]), abs(one[1] - other[1])) + 1
    spots = np.round(np.linspace(one, other, n)).astype(int)
    return bool(is_open[spots[:, 0], spots[:, 1]].all())


def iou(one, other):
    return np.count_nonzero(one & other) / np.count_nonzero(one | other)


@pytest.mark.skipif(not ROOM.exists(), reason="the folder of rooms with truth is missing")
def test_an_office_is_labeled_with_two_strokes_per_object(browser, tmp_path):
    room = np.load(ROOM)
    corners = room["instances"][room["faces"]].astype(int)
    truth = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    write_mesh(tmp_path / "office.ply", Mesh(room["vertices"].astype(float), room["faces"]))
    entries = [{"id": i, "name": name} for i, name in enumerate(CLASSES, 1)]
    entries[0]["stuff"] = entries[1]["stuff"] = True  # floor and wall
    (tmp_path / "classes.json").write_text(json.dumps(entries))
    options = "--scans", "--classes", tmp_path / "classes.json"
    server = studio_page.Command(tmp_path / "office.ply", 80, *options)
    page = browser.new_page(viewport={"width": 1280, "height": 800}, reduced_motion="reduce")
    page.goto(server.address)
    labeler = Labeler(studio_page.Tab(page).ready(), truth)
    try:
        labeler.tab.press("w")
        for owner in (0, 1, 2):  # the floor and two walls
            labeler.fill(owner)
        labeler.tab.press("Shift+U", "k")
        while labeler.n_strokes < 100 and labeler.paint_next():
            pass
        labeler.dab(CUP)
        instances = server.instances()
    finally:
        page.close()
        server.stop()

    classes = instances // 1000
    wanted = np.array([CLASSES.index(name) + 1 for name in NAMES])[truth]
    scores = [iou(classes == i, wanted == i) for i in range(1, len(CLASSES) + 1)]
    objects = [owner for owner in range(3, len(NAMES)) if owner != CUP]
    least = min(
        iou(truth == owner, instances == np.bincount(instances[truth == owner]).argmax())
        for owner in objects
    )
    print(f"{labeler.n_strokes} strokes, mIoU {np.mean(scores):.3f}, least IoU {least:.3f}")
    assert (classes > 0).all()
    assert np.mean(scores) > 0.93
    assert least > 0.5
    assert labeler.n_strokes <= 2.2 * len(NAMES)
