"""Scans of rooms are labeled completely in the studio, by the rules of thumb of the guide."""

import json
import os
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from superfacets import Mesh, write_mesh

studio_page = pytest.importorskip("studio.browser.studio_page")

ROOMS = Path(__file__).resolve().parents[3] / "shared" / "data" / "rooms"
NAMES = {
    "office_d1": "floor wall wall table chair cabinet bookshelf bin cup bear lamp sofa ball bust",
    "bedroom_d1": (
        "floor wall wall wall bed cabinet vase bookshelf table chair bin bear cabinet human"
    ),
}
"""Class of each object in the files."""

SMALL = 80  # number of vertices below which an object may share a region with another object
STUFF = ("floor", "wall")  # classes that F paints, before anything else
ENOUGH = 200  # number of places at which a region that somebody looks for must be seen
N_LOOKS = 9  # number of looks, with five key presses between them, while the view turns around once
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

    def __init__(self, tab, truth, names):
        self.tab, self.truth, self.names, self.n_strokes = tab, truth, names, 0
        self.classes = list(dict.fromkeys(names))
        self.started = []  # objects with a stroke, in the order of their first strokes
        self.labels = tab.labels()
        counts = np.zeros((self.labels.max() + 1, len(names)))
        np.add.at(counts, (self.labels, truth), 1)
        self.owners = counts.argmax(axis=1)  # object that has most of each region

    def choose(self, owner):
        """Choose the class, and the object if several objects have this class."""
        name = self.names[owner]
        number = self.classes.index(name)
        self.tab.locator(".class [type=radio][name=class]").nth(number).click()
        if name in STUFF:
            return
        alike = [one for one in self.started if self.names[one] == name]
        if owner in alike and len(alike) > 1:
            value = alike.index(owner) + 1 << 16 | number + 1
            self.tab.locator(f"input[name=object][value='{value}']").click()
        elif owner not in alike:
            self.started.append(owner)
            if alike:
                self.tab.press("o")

    def picture(self):
        """Return the region at each place of a grid, or -1."""
        cells = np.array(self.tab.evaluate(LOOK, [STEP, MARGIN]))
        return np.where(cells >= 0, self.labels[cells], -1)

    def fill(self, owner):
        """Turn until a region of an object is seen, and press F over the largest one in view."""
        self.choose(owner)
        for _ in range(N_LOOKS):
            seen = self.picture()
            sizes = np.bincount(seen[(seen >= 0) & (self.owners[seen] == owner)], minlength=1)
            if sizes.max() >= ENOUGH:
                break
            self.tab.press(*["ArrowRight"] * 5)
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


def iou_of(found, truth, owner):
    """Return the IoU of an object and the most frequent label of its faces."""
    is_own = truth == owner
    return iou(is_own, found == np.bincount(found[is_own]).argmax())


@pytest.mark.skipif(not ROOMS.exists(), reason="the folder of rooms with truth is missing")
@pytest.mark.skipif(
    "SUPERFACETS_LABEL_ROOMS" not in os.environ, reason="takes minutes: set SUPERFACETS_LABEL_ROOMS"
)
@pytest.mark.parametrize("name", NAMES)
def test_a_room_is_labeled_with_two_strokes_per_object(name, browser, tmp_path):
    names, room = NAMES[name].split(), np.load(ROOMS / f"{name}.npz")
    corners = room["instances"][room["faces"]].astype(int)
    truth = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
    write_mesh(tmp_path / "room.ply", Mesh(room["vertices"].astype(float), room["faces"]))
    classes = list(dict.fromkeys(names))
    entries = [{"id": i, "name": one, "stuff": one in STUFF} for i, one in enumerate(classes, 1)]
    (tmp_path / "classes.json").write_text(json.dumps(entries))
    options = "--scans", "--classes", tmp_path / "classes.json"
    server = studio_page.Command(tmp_path / "room.ply", 80, *options)
    page = browser.new_page(viewport={"width": 1280, "height": 800}, reduced_motion="reduce")
    page.goto(server.address)
    labeler = Labeler(studio_page.Tab(page).ready(), truth, names)
    is_small = np.bincount(room["instances"]) < SMALL
    try:
        labeler.tab.press("w")
        for owner in range(len(names)):
            if names[owner] in STUFF:
                labeler.fill(owner)
        labeler.tab.press("Shift+U", "k")
        while labeler.n_strokes < 100 and labeler.paint_next():
            pass
        for owner in np.flatnonzero(is_small).tolist():
            labeler.dab(owner)
        instances = server.instances()
    finally:
        page.close()
        server.stop()

    found = instances // 1000
    wanted = np.array([classes.index(one) + 1 for one in names])[truth]
    score = np.mean([iou(found == i, wanted == i) for i in range(1, len(classes) + 1)])
    objects = [one for one in np.flatnonzero(~is_small).tolist() if names[one] not in STUFF]
    least = min(iou_of(instances, truth, owner) for owner in objects)
    print(f"{labeler.n_strokes} strokes, mIoU {score:.3f}, least IoU {least:.3f}")
    assert (found > 0).all()
    assert score > 0.93
    assert least > 0.5
    assert labeler.n_strokes <= 2.2 * len(names)
