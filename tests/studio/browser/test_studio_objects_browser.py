"""Objects of one class, distinguished in a real browser by mouse and keyboard alone."""

import json
import re

import numpy as np
import pytest
from studio_page import VIEW, Command, Tab

import superfacets as sf
from superfacets import Mesh, write_mesh
from superfacets_studio.documents.document import Document

CHAIR, FLOOR = 1000, 2000


def box(center, size, n):
    """Return a box whose sides have 2 n^2 triangles each."""
    u, v = (np.ravel(part) for part in np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0)))
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    halves = ([a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1])
    square = np.concatenate([np.stack(half, axis=1) for half in halves])
    points, faces = [], []
    for axis in range(3):
        for side, order in ((0.0, (0, 2, 1)), (1.0, (0, 1, 2))):
            sides = np.roll([np.full(len(u), side), u / n, v / n], axis, axis=0)
            faces.append(square[:, order] + sum(map(len, points)))
            points.append(sides.T)
    return (np.concatenate(points) - 0.5) * size + center, np.concatenate(faces)


@pytest.fixture
def made_room(tmp_path):
    """Return a floor with two chairs on it, and the object of each face, where 0 is the floor."""
    parts = [
        box((0, -0.15, 0), (6, 0.3, 3), 6), box((-1.5, 0.75, 0), (1, 1.4, 1), 4),
        box((1.5, 0.75, 0), (1, 1.4, 1), 4),
    ]  # fmt: skip
    offsets = np.cumsum([0, *(len(points) for points, _ in parts)])
    faces = np.concatenate([part[1] + offset for part, offset in zip(parts, offsets, strict=False)])
    write_mesh(tmp_path / "room.ply", Mesh(np.concatenate([points for points, _ in parts]), faces))
    return tmp_path / "room.ply", np.repeat([0, 1, 2], [len(part[1]) for part in parts])


@pytest.fixture
def real_room(data_dir, tmp_path):
    """Return a part of a scanned room: two cupboards of one class, and their surroundings."""
    path = data_dir / "rooms" / "storage_d1.npz"
    if not path.exists():
        pytest.skip(f"there is no {path.name} in {path.parent}")
    room = np.load(path)
    instances = room["instances"][room["faces"]].max(axis=1)
    middles = room["vertices"][room["faces"]].mean(axis=1)
    low, high = (
        pick(middles[np.isin(instances, [4, 5])], axis=0) + shift
        for pick, shift in ((np.min, -0.2), (np.max, 0.2))
    )
    high[2] = (low[2] + high[2]) / 2  # the lower half, as each face takes time to draw
    is_near = ((middles > low) & (middles < high)).all(axis=1) & np.isin(instances, [0, 4, 5])
    mesh = sf.submesh(Mesh(room["vertices"].astype(float), room["faces"]), is_near * 1, 1).mesh
    write_mesh(tmp_path / "room.ply", mesh)
    return tmp_path / "room.ply", np.select([instances == 4, instances == 5], [1, 2], 0)[is_near]


@pytest.fixture(params=["made", "real"])
def room(request):
    return request.getfixturevalue(f"{request.param}_room")


class Annotator:
    """A simulated user who labels two chairs and the floor, and knows the object of each region."""

    def __init__(self, tab, truth):
        self.tab, self.labels = tab, tab.labels()
        table = np.zeros((self.labels.max() + 1, 3), int)
        np.add.at(table, (self.labels, truth), 1)
        self.instance_of_region = np.array([FLOOR, CHAIR + 1, CHAIR + 2])[table.argmax(axis=1)]

    def label(self):
        """Click visible regions, class by class; press S to go to the hidden ones, one by one."""
        tab = self.tab
        seen = tab.spots(None)
        for number, keys in ((FLOOR, "2"), (CHAIR + 1, "1"), (CHAIR + 2, "o")):
            tab.press(keys)
            if number == FLOOR:
                tab.page.get_by_label("Make class 2 a class").click()  # the floor has no objects
                tab.settled()
            for region, x, y in seen:
                if self.instance_of_region[region] == number:
                    tab.click(x, y)
        tab.locator("#canvas").focus()
        tab.looks_from_one_side()
        tab.press("s")
        while "Every region" not in tab.status:
            self.choose(self.instance_of_region[tab.evaluate("studio.cursor()")])
            tab.press("Enter", "s")
        tab.settled()

    def choose(self, instance):
        """Choose a class by its key, or an object in the list of objects."""
        number, place = divmod(int(instance), 1000)
        if place:
            self.tab.locator(f"input[name=object][value='{place << 16 | number}']").click()
            self.tab.locator("#canvas").focus()
        else:
            self.tab.press(str(number))

    @property
    def expected(self):
        return self.instance_of_region[self.labels]


def test_two_chairs_of_one_class_become_two_objects(room, serve, open_tab, tmp_path):
    path, truth = room
    server = serve(path, 24, Command)
    tab = open_tab(server.address)
    annotator = Annotator(tab, truth)
    annotator.label()
    expected = annotator.expected
    assert np.mean(expected == np.where(truth > 0, CHAIR + truth, FLOOR)) > 0.9
    np.testing.assert_array_equal(server.instances(), expected)

    tab.page.keyboard.press("Control+s")
    tab.wait_for_status("room.ply.studio.jsonl")
    assert "Saved" in tab.locator("#saved").text_content()
    tab.press("Control+z", until="Undone")
    assert (server.instances() == 0).any()
    tab.press("Control+Shift+Z", until="Redone")
    server.kill()
    server.start()
    tab.page.reload()
    tab.ready().settled()
    np.testing.assert_array_equal(server.instances(), expected)

    tab.locator("#export-what").focus()
    tab.page.keyboard.type("instance")
    tab.locator("#export").click()
    tab.wait_for_status("Written")
    check_vertices(path, np.loadtxt(tmp_path / "room.instances.txt", dtype=int), expected)

    merge(tab, path, tmp_path, expected)
    assert np.count_nonzero(server.instances() == CHAIR + 2) > np.count_nonzero(
        expected == CHAIR + 2
    )


def check_vertices(path, written, expected):
    """Check that vertices whose faces are all in one object have the number of that object."""
    faces = sf.read_mesh(path).faces
    lowest, highest = np.full(len(written), 10**6), np.full(len(written), -1)
    np.minimum.at(lowest, faces.ravel(), np.repeat(expected, 3))
    np.maximum.at(highest, faces.ravel(), np.repeat(expected, 3))
    is_inside = lowest == highest
    assert is_inside.mean() > 0.8
    np.testing.assert_array_equal(written[is_inside], lowest[is_inside])
    assert set(np.unique(written)) == {FLOOR, CHAIR + 1, CHAIR + 2}


def merge(tab, path, folder, expected):
    """Accept, by keys, another work in which part of the first chair belongs to the second."""
    work = folder / "theirs.studio.jsonl"
    document = Document.open(path, work)
    for number in (1001, 1002):
        cells = np.flatnonzero(expected == number).astype(np.uint32)
        document.paint(cells, 1, objects=number - CHAIR)
    labels = tab.labels()
    region = labels[np.flatnonzero(expected == 1001)[0]]
    document.paint(np.flatnonzero(labels == region).astype(np.uint32), 1, objects=2)
    theirs = np.where(expected == FLOOR, FLOOR, document.instances)
    document.close()
    tab.locator("#compare").set_input_files(work)
    tab.page.wait_for_selector("#comparison:not([hidden])")
    assert "theirs.studio.jsonl" in tab.locator("#comparison p").text_content()
    tab.locator("#canvas").focus()
    tab.press("d", "t", until="Their labels are taken")
    paint = np.array(tab.evaluate("[...studio.workbench.session.paints.of]"))
    np.testing.assert_array_equal((paint & 0xFFFF) * 1000 + (paint >> 16), theirs)
    assert tab.page.get_by_role("button", name="Next difference").is_disabled()


def test_sections_locks_and_schemes(studio):
    """Clipped cells are hidden, locked cells keep their class, and the background can change."""
    _, tab = studio
    (first, *a), (second, *b) = tab.spots(2)
    tab.press("1")
    tab.click(*a)
    tab.press("k", "2")
    tab.drag(a, b)
    classes, labels = tab.classes(), tab.labels()
    assert set(classes[labels == first]) == {1}
    assert set(classes[labels == second]) == {2}
    tab.press("k")
    n_seen = len(seen(tab))
    tab.press("Alt+X")
    low = seen(tab)
    tab.press("Alt+X")
    high = seen(tab)
    assert max(len(low), len(high)) < n_seen
    tab.press(".", ".")
    assert len(seen(tab)) < len(high)
    handle = tab.locator(".handle.x:not([hidden])").first.bounding_box()
    tab.page.mouse.move(handle["x"] + 9, handle["y"] + 9)
    tab.page.mouse.down()
    tab.page.mouse.move(handle["x"] - 60, handle["y"] + 9, steps=3)
    tab.page.mouse.up()
    assert seen(tab) != high
    tab.press("c")
    assert len(seen(tab)) > 0.95 * n_seen  # a smooth picture shows slightly more cells
    before = tab.evaluate("JSON.stringify(studio.workbench.drawing.camera.eye)")
    tab.drag((4, 60), (80, 90))
    assert tab.evaluate("JSON.stringify(studio.workbench.drawing.camera.eye)") != before
    assert np.array_equal(tab.classes(), classes)
    tab.press("Home")
    narrow = tab.page.viewport_size
    tab.page.set_viewport_size({"width": 900, "height": 460})  # narrow windows show no hints
    a, b = (place for _, *place in tab.spots(2))
    tab.locator("#scheme").select_option("meshlab")
    assert "Paint: right drag" in tab.locator("#turning").text_content()
    tab.drag(a, b)
    assert np.array_equal(tab.classes(), classes)
    tab.locator("#scheme").select_option("studio")
    tab.page.set_viewport_size(narrow)
    box_ = tab.locator("#new-object")
    tab.press("0")
    assert box_.get_attribute("title") == "Choose a class first"


def seen(tab):
    return set(tab.evaluate("[...new Set(studio.workbench.drawing.cellsSeen().cells)]"))


def test_two_fingers_turn_and_one_paints(bear, serve, browser, errors):
    context = browser.new_context(**VIEW, has_touch=True)
    page = context.new_page()
    page.goto(serve(bear, 40).address)
    tab = Tab(page).ready()
    assert "two fingers" in tab.locator("#turning").text_content()
    region, x, y = tab.spots(1)[0]
    box_ = tab.locator("#canvas").bounding_box()
    page.touchscreen.tap(box_["x"] + x, box_["y"] + y)
    tab.settled()
    classes = tab.classes()
    assert set(classes[tab.labels() == region]) == {1}
    before = tab.evaluate("JSON.stringify(studio.workbench.drawing.camera.eye)")
    touch = context.new_cdp_session(page)
    for kind, shift in (("touchStart", 0), ("touchMove", 30), ("touchEnd", None)):
        points = [] if shift is None else [
            {"x": box_["x"] + x + shift, "y": box_["y"] + y, "id": 1},
            {"x": box_["x"] + x + 60 + 2 * shift, "y": box_["y"] + y, "id": 2},
        ]  # fmt: skip
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    tab.settled()
    assert tab.evaluate("JSON.stringify(studio.workbench.drawing.camera.eye)") != before
    assert np.array_equal(tab.classes(), classes)
    context.close()


def lab(color):
    """Return the CIELAB coordinates of a color such as rgb(1,2,3) or #010203."""
    numbers = re.findall(r"\d+", color) if color.startswith("rgb") else bytes.fromhex(color[1:])
    part = np.array([int(number) for number in numbers]) / 255
    light = np.where(part > 0.04045, ((part + 0.055) / 1.055) ** 2.4, part / 12.92)
    white = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x, y, z = np.cbrt(np.maximum(white @ light / np.sum(white, axis=1), 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("n", [6, 20])
def test_objects_never_look_like_another_class(n, bear, serve, open_tab, tmp_path):
    """Check the default classes, and 20 named ones of which the last is "other"."""
    server = serve(bear, 40)
    tab = open_tab(server.address)
    if n > 6:
        runs = [{"id": k, "name": "other" if k == n else f"kind {k}"} for k in range(7, n + 1)]
        classes = [*server.state()["classes"], *runs]
        server.request("files/0/classes", data=json.dumps({"classes": classes}).encode())
        tab.page.reload()
        tab.ready()
    colors = {entry["id"]: lab(entry["color"]) for entry in server.state()["classes"]}
    assert len(colors) == n
    for number, color in colors.items():
        shades = [
            lab(tab.evaluate(f"studio.workbench.paintColor({k << 16 | number})"))
            for k in range(1, 6)
        ]
        np.testing.assert_allclose(shades[0], color)
        others = [other for one, other in colors.items() if one != number]
        assert np.linalg.norm(np.array(shades[1:])[:, None] - others, axis=2).min() > 14
        apart = np.linalg.norm(np.array(shades)[:, None] - shades, axis=2)
        assert apart[np.triu_indices(5, 1)].min() > 7


def test_the_mesh_shows_the_colors_of_objects_as_the_list_does(studio):
    _, tab = studio
    for object_, (_, x, y) in enumerate(tab.spots(4), start=2):
        tab.evaluate(f"studio.workbench.choose(5, {object_})")
        tab.click(x, y)
        tab.settled()
        tab.away()
        shown = tab.evaluate("studio.workbench.paintColor(studio.workbench.currentPaint)")
        color = np.array([int(number) for number in re.findall(r"\d+", shown)])
        assert np.abs(tab.hue_at(x, y) - color / color.sum()).max() < 0.03
