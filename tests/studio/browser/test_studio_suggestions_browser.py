"""Suggested objects in a real browser: shown, accepted and rejected by mouse and keyboard alone."""

import json
import re

import numpy as np
import pytest
from studio_page import hue

from superfacets import Mesh, PointCloud, write_mesh

SCORES = (0.9, 0.6, 0.75, 0.3)


@pytest.fixture
def suggest(tmp_path):
    """Return a function that suggests the most visible regions and returns their places."""

    def given(tab, labels):
        spots, of_cells = tab.spots(len(labels)), tab.labels()
        tab.looks_from_one_side()
        np.save(tmp_path / "lifted.npy", of_cells.astype(np.int32))
        groups = [
            {"segments": [region], "label": label, "score": score}
            for (region, *_), label, score in zip(spots, labels, SCORES, strict=False)
        ]
        (tmp_path / "lifted.aggregation.json").write_text(json.dumps({"segGroups": groups}))
        tab.locator("#as-suggestions").check()
        tab.locator("#import").set_input_files(
            [tmp_path / "lifted.npy", tmp_path / "lifted.aggregation.json"]
        )
        tab.wait_for_status(f"{len(labels)} suggested object")
        tab.locator("#canvas").focus()
        return spots

    return given


def instances_of(server, tab, spots):
    """Return class * 1000 + object of each of these regions."""
    labels, found = tab.labels(), server.instances()
    values = [np.unique(found[labels == region]) for region, *_ in spots]
    assert all(len(value) == 1 for value in values)
    return [int(value[0]) for value in values]


def rows(tab):
    """Names and scores."""
    return [re.sub(r"[\d,]+ · ", "", text) for text in sizes(tab)]


def sizes(tab):
    """Names, numbers of cells and scores."""
    return tab.locator("#suggestions button").all_text_contents()


def test_keys_accept_and_reject_what_is_chosen_or_under_the_pointer(studio, suggest):
    server, tab = studio
    spots = suggest(tab, ("chair", "chair", "object", "table"))
    assert rows(tab) == ["chair0.90", "no class yet0.75", "chair0.60", "table0.30"]
    assert not tab.classes().any()
    chair = next(entry["id"] for entry in server.state()["classes"] if entry["name"] == "chair")

    n_cells = np.count_nonzero(tab.labels() == spots[0][0])
    assert sizes(tab)[0] == f"chair{n_cells} · 0.90"
    tab.press("j", "a")  # accept the best one, and go to the next
    tab.wait_for_status(
        "Suggestion accepted: chair. 3 left. The next one is chosen: no class yet, score 0.75."
    )
    assert instances_of(server, tab, spots) == [1000 * chair + 1, 0, 0, 0]
    assert tab.locator("#suggestions [aria-current=true]").text_content().endswith(" · 0.75")
    tab.press("2", "a", until="accepted: class 2")  # as an object of the chosen class
    assert instances_of(server, tab, spots) == [1000 * chair + 1, 0, 2001, 0]

    tab.press("Home")
    tab.page.mouse.move(*tab._on_page(*spots[3][1:]))
    tab.until("document.querySelector('#tip').textContent.includes('Suggested: table')")
    tab.press("r", until="Suggestion rejected. 1 left.")
    tab.press("Control+z", until="Undone: suggestion")
    assert rows(tab) == ["chair0.60", "table0.30"]
    assert "A accepts" in tab.locator("#hint").text_content()

    tab.locator("#least-score").fill("0")
    tab.locator("#accept-all").click()
    tab.wait_for_status("2 suggestions accepted: chair, table. None left.")
    assert instances_of(server, tab, spots)[:3] == [1000 * chair + 1, 1000 * chair + 2, 2001]
    assert tab.locator("#suggestions-section").is_hidden()
    tab.press("a")
    assert "no suggestions" in tab.status
    tab.press("Control+z", until="Undone")
    assert instances_of(server, tab, spots) == [1000 * chair + 1, 0, 2001, 0]


def test_j_after_a_visits_every_suggestion(studio, suggest):
    _, tab = studio
    suggest(tab, ("chair", "chair", "table", "table"))
    tab.press("j")
    for name, n_left in (("chair", 3), ("table", 2), ("chair", 1)):
        tab.press("a", until=f"Suggestion accepted: {name}. {n_left} left.")
        tab.press("j")
    tab.wait_for_status("Suggestion: table, score 0.30.")
    tab.press("Control+z", "Control+z")
    tab.settled()
    tab.press("j", "j")  # the first J goes to the best one, and the second to the next
    assert tab.locator("#suggestions [aria-current=true]").text_content().endswith(" · 0.60")


def test_shift_gives_the_chosen_class_and_only_good_scores_are_accepted(studio, suggest):
    server, tab = studio
    spots = suggest(tab, ("chair", "chair", "table"))
    tab.press("3", "j", "Shift+A", until="accepted: class 3")
    tab.locator("#least-score").fill("0.7")
    assert tab.locator("#accept-all").text_content() == "Accept all of them (1)"
    tab.locator("#accept-all").click()
    tab.wait_for_status("accepted: table")
    first, second, third = instances_of(server, tab, spots)
    assert (first, second) == (3001, 0)
    assert third > 3001


def test_pieces_of_a_class_without_scores_are_suggested_largest_first(studio, tmp_path):
    _, tab = studio
    labels, (first, second) = tab.labels(), tab.evaluate(APART)
    counts = np.bincount(labels)[[first, second]]
    np.save(tmp_path / "classes.npy", 2 * np.isin(labels, [first, second]).astype(np.int32))
    tab.locator("#as-suggestions").check()
    tab.locator("#import").set_input_files(tmp_path / "classes.npy")
    tab.wait_for_status("2 suggested objects")
    assert sizes(tab) == [f"class 2{n}" for n in sorted(counts, reverse=True)]
    assert counts[0] < counts[1]
    tab.locator("#least-score").fill("1")  # has no effect without scores
    assert tab.locator("#accept-all").text_content() == "Accept all of them (2)"


APART = """(() => {  // the smallest region, and a larger one that is not its neighbor
    const { regions } = studio.workbench.session;
    const count = (r) => regions.cellsOf(r).length;
    const all = [...Array(regions.count).keys()].sort((a, b) => count(a) - count(b));
    const near = regions.neighbors.of(all[0]);
    return [all[0], all.find((r) => count(r) > count(all[0]) && !near.includes(r))];
})()"""


def test_suggestions_are_hatched_in_the_color_of_their_class_and_labels_cover_them(studio, suggest):
    server, tab = studio
    _, x, y = tab.spots(1)[0]
    before = tab.hue_at(x, y)
    suggest(tab, ("class 2",))
    tab.press("Home")
    tab.away()
    around = [tab.hue_at(x + dx, y) for dx in range(-8, 9)]
    color = hue(server.state()["classes"][1]["color"])
    assert min(np.abs(one - color).max() for one in around) < 0.05
    assert max(np.abs(one - color).max() for one in around) > 0.05  # between the lines
    tab.press("1")
    tab.click(x, y)
    tab.away()
    painted = [tab.hue_at(x + dx, y) for dx in range(-8, 9)]
    expected = hue(server.state()["classes"][0]["color"])
    assert max(np.abs(one - expected).max() for one in painted) < 0.05
    assert np.abs(before - color).max() > 0.05


def test_suggestions_survive_a_killed_server(command, suggest):
    server, tab = command
    spots = suggest(tab, ("chair", "table"))
    tab.press("j", "a", until="1 left")
    accepted = instances_of(server, tab, spots)
    server.kill()
    server.start()
    tab.page.reload()
    tab.ready().settled()
    assert rows(tab) == ["table0.60"]
    assert instances_of(server, tab, spots) == accepted
    tab.press("Control+z", until="Undone: suggestion")
    assert rows(tab) == ["chair0.90", "table0.60"]


def test_the_key_w_looks_through_walls_seen_from_behind(serve, open_tab, tmp_path):
    """Two parallel walls face each other: from outside, the near one hides the far one."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(np.concatenate([square, square + [0, 1, 0]]), [*faces[:, ::-1], *(faces + 4)])
    write_mesh(tmp_path / "walls.ply", mesh)
    tab = open_tab(serve(tmp_path / "walls.ply", 2).address)
    tab.press("Alt+3")

    def seen():
        cells = tab.evaluate("[...new Set(studio.workbench.drawing.cellsSeen().cells)]")
        return {cell // 2 for cell in cells if cell < 4}

    near = seen()
    tab.press("w")
    assert tab.locator("#inside").get_attribute("aria-pressed") == "true"
    assert (len(near), len(seen()), len(near | seen())) == (1, 1, 2)
    tab.press("w")
    assert seen() == near


def test_the_key_w_hides_points_seen_from_behind_if_the_file_has_normals(serve, open_tab, tmp_path):
    """Two parallel walls of points face each other; the next file has the same points alone."""
    across, up = (place.ravel() for place in np.meshgrid(*[np.arange(40) / 40] * 2))
    wall = np.column_stack([across, np.zeros(1600), up])
    points = np.vstack([wall, wall + [0, 1, 0]])
    normals = np.repeat([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], 1600, axis=0)
    write_mesh(tmp_path / "a.ply", PointCloud(points, normals))
    write_mesh(tmp_path / "b.ply", PointCloud(points))
    tab = open_tab(serve(tmp_path, 2).address)
    tab.press("Alt+3")

    def walls_seen():
        cells = np.array(tab.evaluate("[...studio.workbench.drawing.cellsSeen().cells]"))
        return [bool(((low <= cells) & (cells < low + 1600)).any()) for low in (0, 1600)]

    def pressed():
        return tab.locator("#inside").get_attribute("aria-pressed")

    near = walls_seen()
    assert sum(near) == 1
    tab.press("w")
    assert pressed() == "true"
    assert walls_seen() == near[::-1]
    tab.press("PageDown")
    tab.until("document.querySelector('#file-name').textContent === 'b.ply'")
    tab.ready().press("Alt+3")
    assert pressed() == "false"
    assert walls_seen() == near
    tab.press("w", until="The point cloud has no normals")
    assert (pressed(), walls_seen()) == ("false", near)


def test_with_the_key_w_surfaces_at_different_depths_have_no_black_outlines(
    serve, open_tab, tmp_path
):
    """Outlines would turn specks of noisy walls into black dots. Borders of regions remain."""
    wall = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    speck = [0.4, 0.4, 1] + [0.1, 0.2, 0] * wall
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices = np.concatenate([wall, wall + [1, 0, 0], speck])
    write_mesh(tmp_path / "walls.ply", Mesh(vertices, [*faces, *(faces + 4), *(faces + 8)]))
    tab = open_tab(serve(tmp_path / "walls.ply", 3).address)
    tab.press("Alt+3")
    tab.away()

    def n_lines():
        """Return the number of black lines across the middle row of the canvas."""
        is_black = tab.evaluate("""[...Array(canvas.clientWidth).keys()].map(
            (x) => Math.max(...studio.pixelAt(x, canvas.clientHeight / 2)) < 100)""")
        return int((np.diff(np.array(is_black, int)) == 1).sum())

    assert n_lines() == 4
    tab.press("w")
    assert n_lines() == 2


def test_the_help_begins_at_its_top_and_tells_the_buttons_of_the_chosen_scheme(studio):
    _, tab = studio
    choose = "name => { scheme.value = name; scheme.dispatchEvent(new Event('change')); }"
    tab.evaluate(choose, "blender")
    tab.press("?")
    help_ = tab.locator("#help")
    assert help_.evaluate("one => one.scrollTop") == 0
    assert "Shift + middle drag" in help_.text_content()
    tab.press("Escape")
    tab.evaluate(choose, "studio")
    tab.press("?")
    assert "Shift + middle drag" not in help_.text_content()
    tab.press("Escape")
