"""The studio in a real browser: actions are shown, saved, and survive crashes and reloads."""

from itertools import pairwise

import numpy as np
import shapes
from scipy import spatial
from studio_page import VIEW, Tab, hue

import superfacets as sf
from superfacets import Mesh, PolygonMesh, TetMesh, sample_mesh, write_mesh
from superfacets_studio.web.address import redirection


def test_a_moved_slider_changes_the_labels_and_undo_brings_them_back(studio):
    server, tab = studio
    before = tab.labels()
    assert before.max() + 1 == tab.evaluate("studio.nRegions") == 40
    slider = tab.locator("#n_segments")
    slider.focus()
    for _ in range(5):  # the regions of each come before the next
        tab.press("ArrowRight")
        tab.settled()
    wanted = int(tab.locator("output[for=n_segments]").text_content())
    assert wanted > 40
    assert tab.evaluate("studio.nRegions") == wanted
    assert server.state()["parameters"]["n_segments"] == wanted
    assert not np.array_equal(tab.labels(), before)

    tab.locator("#coarser").click()
    tab.settled()
    assert tab.evaluate("studio.nRegions") < wanted
    tab.locator("#radius").fill("0.4")
    tab.locator("#radius").press("Enter")
    tab.settled()
    area = sf.build_face_graph(sample_mesh(3_000)).measures.sum()
    assert tab.evaluate("studio.nRegions") == round(area / (np.pi * 0.4**2))
    for _ in range(7):
        if tab.locator("#undo").is_disabled():
            break
        tab.locator("#undo").click()
        tab.settled()
    assert tab.status == "Undone: new regions."
    np.testing.assert_array_equal(tab.labels(), before)


def test_painted_regions_have_the_color_of_their_class_through_undo_and_reload(studio):
    server, tab = studio
    colors = [entry["color"] for entry in server.state()["classes"]]
    spots = tab.spots(3)
    for number, (_, x, y) in enumerate(spots, start=1):
        assert np.abs(tab.hue_at(x, y) - hue(colors[number - 1])).max() > 0.05
        tab.press(str(number))
        tab.click(x, y)
        tab.evaluate("new Promise(requestAnimationFrame)")
    *_, width, height = tab.evaluate("studio.workbench.drawing.part")
    assert 0 < width * height < tab.evaluate("canvas.width * canvas.height") / 2
    tab.away()
    for number, (region, x, y) in enumerate(spots, start=1):
        np.testing.assert_allclose(tab.hue_at(x, y), hue(colors[number - 1]), atol=0.03)
        assert set(tab.classes()[tab.labels() == region]) == {number}
    assert tab.locator("#progress-text").text_content() != "0.0 %"
    tab.settled()
    np.testing.assert_array_equal(server.classes(), tab.classes())

    tab.press("Control+z", until="Undone")
    last = spots[-1]
    assert not tab.classes()[tab.labels() == last[0]].any()
    assert np.abs(tab.hue_at(*last[1:]) - hue(colors[2])).max() > 0.05
    tab.press("Control+Shift+Z", until="Redone")
    np.testing.assert_allclose(tab.hue_at(*last[1:]), hue(colors[2]), atol=0.03)

    painted = tab.classes()
    tab.page.reload()
    tab.ready()
    np.testing.assert_array_equal(tab.classes(), painted)
    np.testing.assert_allclose(tab.hue_at(*spots[0][1:]), hue(colors[0]), atol=0.03)


def test_borders_are_smooth_but_labels_and_picked_cells_are_the_same(serve, open_tab, tmp_path):
    rows, columns = np.indices((28, 24))
    points = np.stack([columns + rows % 2 / 2, rows * 0.75**0.5], axis=-1).reshape(-1, 2)
    mesh = Mesh(np.insert(points, 2, 0.0, axis=1), spatial.Delaunay(points).simplices)
    write_mesh(tmp_path / "flat.ply", mesh)
    tab = open_tab(serve(tmp_path / "flat.ply", 6).address)
    tab.until("studio.workbench.smoothed === studio.workbench.session.regions")
    tab.evaluate("studio.workbench.drawing.camera.turnTo(0, Math.PI / 2)")
    tab.click(*tab.spots(1)[0][1:])
    tab.away()
    before = tab.labels(), tab.classes()

    def seen():
        """Return the picked cells, and the number of turns along the sides of the painted part."""
        cells, colors, width = tab.evaluate("""() => {
            const { drawing } = studio.workbench;
            drawing.draw(1);
            return [[...drawing.cellsSeen().cells], [...drawing.pixels()], drawing.canvas.width];
        }""")
        colors = np.array(colors, np.uint32).view(np.uint8).reshape(-1, width, 4)
        is_painted = np.ptp(colors[..., :3], axis=2) > 60
        steps = np.diff([np.flatnonzero(row)[[0, -1]] for row in is_painted if row.any()], axis=0)
        return cells, sum(np.count_nonzero(np.diff(np.sign(side[side != 0]))) for side in steps.T)

    smooth = seen()
    tab.press("b")  # for single cells, whole faces are drawn
    exact = seen()
    assert (exact[0], smooth[1]) == (smooth[0], 0)
    assert exact[1] >= 4
    tab.press("v")
    assert seen() == smooth
    np.testing.assert_array_equal((tab.labels(), tab.classes()), before)


def test_drag_shift_and_ctrl_paint_erase_and_pick(studio):
    server, tab = studio
    (first, *a), (second, *b), (third, *c) = tab.spots(3)
    tab.press("2")
    tab.drag(a, b)
    classes, labels = tab.classes(), tab.labels()
    assert set(classes[labels == first]) == set(classes[labels == second]) == {2}
    assert set(classes) == {0, 2}
    tab.click(*a, key="Shift")
    assert not tab.classes()[labels == first].any()
    tab.press("1")
    tab.click(*b, key="Control")
    tab.click(*c)
    assert set(tab.classes()[labels == third]) == {2}
    tab.press("Control+z", "Control+z", "Control+z")
    tab.settled()
    assert tab.locator("#undo").is_disabled()
    assert not tab.classes().any()
    assert not server.classes().any()


def test_a_region_is_split_between_red_and_blue(studio):
    _, tab = studio
    region, x, y = tab.spots(1)[0]
    before = tab.labels()
    tab.press("x")
    assert "Split" in tab.locator("#mode").text_content()
    tab.drag((x - 14, y - 4), (x - 14, y + 4))
    red = tab.evaluate("([x, y]) => studio.cellAt(x, y)", [x - 14, y])
    tab.drag((x + 14, y - 4), (x + 14, y + 4), key="Shift")
    blue = tab.evaluate("([x, y]) => studio.cellAt(x, y)", [x + 14, y])
    assert tab.status == "Enter cuts between red and blue."
    tab.away()
    np.testing.assert_allclose(tab.hue_at(x - 14, y), hue("#d91220"), atol=0.06)
    tab.press("Enter")
    tab.settled()
    after = tab.labels()
    assert after[red] != after[blue]
    np.testing.assert_array_equal(before != region, (after != after[red]) & (after != after[blue]))
    tab.press("Escape", "Control+z")
    tab.settled()
    assert tab.evaluate("studio.nRegions") == 40
    np.testing.assert_array_equal(tab.labels(), before)


def test_what_hides_a_region_from_all_sides_is_left_out(serve, open_tab, tmp_path):
    small = shapes.cube()
    mesh = shapes.together([small, Mesh(4 * small.vertices - 1.5, small.faces)])
    write_mesh(tmp_path / "nested.ply", mesh)
    tab = open_tab(serve(tmp_path / "nested.ply", 1).address)
    inner, outer = tab.labels()[[0, -1]].tolist()
    assert {region for region, *_ in tab.spots(None)} == {outer}
    tab.evaluate("region => studio.workbench.setCursor(region)", inner)
    assert "what hides it is left out" in tab.status
    assert {region for region, *_ in tab.spots(None)} == {inner, outer}
    tab.press("Escape")
    spots = tab.spots(None)
    assert {region for region, *_ in spots} == {outer}
    tab.press("Shift+S")  # for a few seconds
    np.testing.assert_allclose(tab.hue_at(*spots[0][1:]), hue("#ff00bf"), atol=0.02)


def test_a_stroke_in_another_region_is_refused(studio):
    _, tab = studio
    (region, x, y), (_, u, v) = tab.spots(2)
    tab.press("x")
    tab.drag((x, y), (x, y + 4))
    assert tab.status == "Now draw a blue stroke with Shift-drag."
    tab.drag((u, v), (u, v + 4), key="Shift")
    assert tab.status == f"Both strokes must be in region {region}. X removes the strokes."


def test_nothing_is_lost_when_the_server_is_killed_while_one_paints(command):
    server, tab = command
    (first, *a), (second, *b), (third, *c) = tab.spots(3)
    tab.press("3")
    tab.click(*a)
    tab.settled()
    server.kill()
    tab.press("2")
    tab.click(*b)
    tab.page.wait_for_selector("#banner:has-text('1 unsaved stroke')")
    tab.click(*c)
    tab.locator("#undo").click()
    tab.until("document.querySelector('#status').textContent.includes('so undo has to wait')")
    assert tab.locator("#error").is_hidden()
    assert tab.evaluate("studio.nWaiting") == 2
    server.start()
    tab.settled()
    assert tab.locator("#banner").is_hidden()
    labels, classes = tab.labels(), server.classes()
    assert set(classes[labels == first]) == {3}
    assert set(classes[labels == second]) == set(classes[labels == third]) == {2}
    assert (classes > 0).sum() == np.isin(labels, [first, second, third]).sum()
    np.testing.assert_array_equal(tab.classes(), classes)


def test_strokes_that_wait_survive_the_page_too(command):
    server, tab = command
    region, x, y = tab.spots(1)[0]
    server.kill()
    tab.click(x, y)
    tab.page.wait_for_selector("#banner:has-text('1 unsaved stroke')")
    tab.page.once("dialog", lambda dialog: dialog.accept())
    tab.page.goto("about:blank")
    server.start()
    tab.page.goto(server.address)
    tab.ready()
    tab.settled()
    assert set(server.classes()[tab.labels() == region]) == {1}


def test_all_is_done_without_a_mouse(studio):
    server, tab = studio
    for _ in range(90):
        if tab.evaluate("document.activeElement.id") == "canvas":
            break
        tab.press("Tab")
    assert tab.evaluate("document.activeElement.id") == "canvas"
    tab.press("n", "n", "2", "Enter")
    region = tab.evaluate("studio.cursor()")
    assert set(tab.classes()[tab.labels() == region]) == {2}
    tab.press("s")
    assert tab.evaluate("studio.cursor()") != region
    tab.press("+", "1", "Enter")
    assert len(set(tab.labels()[tab.classes() == 1])) > 2
    tab.press("s", "Delete", "x", "Enter")
    tab.settled()
    assert tab.evaluate("studio.nRegions") == 41
    tab.press("?")
    assert tab.locator("#help").is_visible()
    tab.press("Escape")
    assert not tab.locator("#help").is_visible()
    tab.settled()
    np.testing.assert_array_equal(server.classes(), tab.classes())


def test_unlabeled_regions_in_view_come_first_and_z_goes_back_after_flights_to_others(studio):
    _, tab = studio
    tab.looks_from_one_side()
    place = "JSON.stringify(studio.workbench.drawing.camera.place.map((one) => one.toFixed(6)))"
    large = [region for region, _, _ in tab.spots(8)]
    regions, places = [], [tab.evaluate(place)]
    tab.locator("#next-bare").click()
    assert tab.evaluate("document.activeElement.id") == "canvas"
    regions.append(tab.evaluate("studio.cursor()"))
    tab.press("2", "Enter")  # Enter paints the region, and does not press the button
    assert set(tab.labels()[tab.classes() == 2]) == set(regions)
    for _ in range(39):
        tab.press("s")
        regions.append(tab.evaluate("studio.cursor()"))
        places.append(tab.evaluate(place))
    assert sorted(regions) == list(range(40))
    assert set(large) <= set(regions[: places.count(places[0])])  # without a flight
    jumps = [one for one, after in pairwise(places) if one != after]
    assert jumps
    for one in reversed(jumps):
        tab.page.get_by_role("button", name="Undo view").click()
        assert tab.evaluate(place) == one


def test_the_mesh_has_the_focus_after_a_class_or_an_object_was_chosen(studio):
    _, tab = studio
    for control in ("#classes output >> nth=1", "#new-object", "[name=object] >> nth=0"):
        tab.locator(control).click()
        assert tab.evaluate("document.activeElement.id") == "canvas", control
    for key in "10":
        tab.locator("#help-button").focus()
        tab.press(key)
        assert tab.evaluate("document.activeElement.id") == "canvas", key


def test_messages_neither_move_the_view_nor_take_its_clicks(studio):
    _, tab = studio
    emit = "([kind, told]) => studio.workbench.session.events.emit(kind, told)"
    box = tab.locator("#canvas").bounding_box()
    for kind, told, place in (
        ("message", "words " * 99, "#status"),
        ("error", "words " * 99, "#error span"),
        ("online", False, "#banner"),
    ):
        tab.evaluate(emit, [kind, told])
        assert tab.locator(place).evaluate("one => getComputedStyle(one).pointerEvents") == "none"
        assert tab.locator("#canvas").bounding_box() == box
    tab.locator("#error button").click()
    tab.evaluate(emit, ["online", True])


def test_unlabeled_regions_are_gray_once_a_cell_has_a_class(studio):
    _, tab = studio
    (_, *painted), *others = tab.spots(5)
    chroma = [np.ptp(tab.hue_at(*place)) for _, *place in others]
    assert max(chroma) > 0.05
    tab.click(*painted)
    tab.away()
    assert np.ptp(tab.hue_at(*painted)) > 0.2
    assert max(np.ptp(tab.hue_at(*place)) for _, *place in others) < 0.01
    tab.press("Control+z", until="Undone")
    assert [np.ptp(tab.hue_at(*place)) for _, *place in others] == chroma


def test_a_view_button_pressed_again_shows_the_opposite_side(studio):
    _, tab = studio
    for name in ("Front", "Side", "Top"):
        toward = []
        for _ in range(3):
            tab.page.get_by_role("button", name=name, exact=True).click()
            toward.append(tab.evaluate("studio.workbench.drawing.camera.directions()[2]"))
        np.testing.assert_allclose(toward[1], np.negative(toward[0]), atol=1e-9)
        assert toward[2] == toward[0]


def test_the_introduction_tells_to_name_a_class_only_if_no_class_has_a_name(
    serve, browser, tmp_path
):
    with browser.new_page(**VIEW) as page:
        for name, is_shown in (("class 1", True), ("roof", False)):
            folder = tmp_path / name
            folder.mkdir()
            write_mesh(folder / "bear.ply", sample_mesh(3_000))
            (folder / "superfacets-classes.json").write_text(f'["{name}"]')
            page.goto(serve(folder, 40).address)  # the browser remembers visits by address
            page.wait_for_function("() => window.studio && studio.ready")
            assert page.locator("#welcome").is_visible()
            assert page.locator("#welcome-name").is_visible() == is_shown


def test_lasso_and_brush_paint_what_is_seen(studio):
    _, tab = studio
    region, x, y = tab.spots(1)[0]
    tab.press("l", "1")
    tab.drag(*tab.corners)
    tab.wait_for_status("regions: ")
    painted = set(tab.labels()[tab.classes() == 1])
    assert region in painted
    assert f" {40 - len(painted)} regions behind were left out, because" in tab.status
    tab.press("Escape", "b", "4")
    tab.drag((x, y), (x + 10, y))
    cells = tab.classes() == 4
    assert cells[tab.evaluate("([x, y]) => studio.cellAt(x, y)", [x, y])]
    assert 3 < cells.sum() < (tab.labels() == region).sum() + 400
    tab.press("l", "l", "3")
    tab.drag((x - 8, y - 8), (x + 8, y - 8), (x + 8, y + 8), (x - 8, y + 8))
    tab.wait_for_status("cells: ")
    assert 0 < (tab.classes() == 3).sum() < cells.sum() + 100


def test_the_lasso_leaves_regions_of_which_only_a_sliver_is_seen(studio):
    _, tab = studio
    (sliver, *_), (whole, *_) = tab.spots(2)
    n_seen = tab.evaluate(
        """region => {
            const { workbench } = studio;
            const drawn = new Set(workbench.drawing.cellsSeen().cells);
            const cells = workbench.session.regions.cellsOf(region);
            const seen = cells.filter((cell) => drawn.has(cell));
            const kept = new Set(seen.slice(0, cells.length / 10));
            workbench.hide(cells.filter((cell) => !kept.has(cell)), "Most of a region");
            return kept.size;
        }""",
        sliver,
    )
    assert n_seen > 5
    tab.press("l", "1")
    tab.drag(*tab.corners)
    tab.wait_for_status("regions: ")
    painted = set(tab.labels()[tab.classes() == 1])
    assert whole in painted
    assert sliver not in painted
    tab.press("u")
    tab.drag(*tab.corners)
    tab.settled()
    assert sliver in set(tab.labels()[tab.classes() == 1])


def test_f_stays_where_similar_regions_are_connected_and_tells_what_is_left(studio):
    _, tab = studio
    region, x, y = tab.spots(1)[0]
    n = tab.evaluate("studio.nRegions")
    ring = tab.evaluate(
        "region => studio.workbench.session.regions.neighbors.ringAround(new Set([region]))", region
    )
    tab.evaluate(
        """ring => {
            const { session, currentPaint } = studio.workbench;
            session.paint(session.regions.cellsOfAll(ring), currentPaint);
        }""",
        ring,
    )
    tab.settled()
    tab.evaluate("studio.workbench.tolerance = 1")  # all regions are similar
    tab.press("2")
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until(f"studio.regionAt({x}, {y}) === {region} && studio.workbench.hoveredCell >= 0")
    tab.press("f")  # the neighbors have a class, so the fill ends there
    tab.wait_for_status(
        "1 similar region: class 2 #1 (F paints; Ctrl+Z undoes, S goes on)."
        f" Unlabeled regions: {n - len(ring)} before,"
        f" {n - len(ring) - 1} now. Similar regions left out: {len(ring)} labeled already,"
        f" {n - 1 - len(ring)} not connected to this region by similar regions."
    )
    assert "raise" not in tab.status  # the tolerance is at its maximum
    assert set(tab.labels()[tab.classes() == 2]) == {region}
    assert "class 2" in tab.locator("#tip").text_content()
    tab.press("Control+z", until="Undone")
    assert "No class" in tab.locator("#tip").text_content()  # although the pointer has not moved
    tab.press("Control+z", until="Undone")
    tab.press("f", until=f"goes on). Unlabeled regions: {n} before, 0 now.")
    tab.press("Control+z", until="Undone")
    tab.evaluate("studio.workbench.tolerance = 0.01")
    tab.press("f", until="For more, raise “Similar shapes” (now 0.01).")
    tab.evaluate("studio.workbench.tolerance = 0.05")


def test_g_makes_the_region_under_the_pointer_the_center_of_rotation(studio):
    _, tab = studio
    region, x, y = tab.spots(1)[0]
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until(f"studio.workbench.regionOf(studio.workbench.hoveredCell) === {region}")
    tab.press("g")
    places = tab.evaluate(f"""() => {{
        const {{ session: {{ mesh, regions }}, drawing: {{ camera }} }} = studio.workbench;
        const [low, high] = [[9, 9, 9], [-9, -9, -9]];
        mesh.extend({{ low, high }}, regions.cellsOf({region}));
        return [camera.target, low, high];
    }}""")
    target, low, high = np.array(places)
    assert ((low <= target) & (target <= high)).all()
    tab.until("studio.workbench.hoveredCell >= 0")  # although the pointer has not moved
    tab.press("h", until="is hidden; U shows all.")
    tab.press("?")
    assert "turn the view around it" in tab.locator("#help").text_content()
    tab.press("Escape")


def test_hidden_regions_are_not_seen_and_come_back(studio):
    _, tab = studio
    region, x, y = tab.spots(1)[0]
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until(f"document.querySelector('#tip').textContent.includes('Region {region}')")
    tab.press("h")
    assert tab.evaluate("([x, y]) => studio.regionAt(x, y)", [x, y]) != region
    tab.press("u")
    assert tab.evaluate("([x, y]) => studio.regionAt(x, y)", [x, y]) == region


def test_n_and_s_never_lead_to_hidden_regions(studio):
    _, tab = studio
    left = tab.evaluate("""() => {
        const { session, drawing } = studio.workbench;
        const xs = session.mesh.shape.positions.values.filter((_, i) => i % 3 === 0);
        const middle = (3 * Math.min(...xs) + Math.max(...xs)) / 4;
        drawing.clip = { low: [-9, -9, -9], high: [middle, 9, 9] };
        const isLeft = (cell) => session.mesh.middleOf(cell)[0] <= middle;
        return [...Array(studio.nRegions).keys()].filter(
            (region) => session.regions.cellsOf(region).some(isLeft));
    }""")
    assert 3 < len(left) < tab.evaluate("studio.nRegions")
    partly = left[0]  # its first cell is hidden, others are not
    tab.evaluate(f"""() => {{
        const {{ workbench }} = studio;
        workbench.hide(workbench.session.regions.cellsOf({partly}).subarray(0, 1), "A cell");
        workbench.hide(workbench.session.regions.cellsOf({left[1]}), "A region");
    }}""")
    tab.looks_from_one_side()
    shown = set(left) - {left[1]}
    for key in "nps":
        tab.press("Escape")
        visited = []
        for _ in range(len(shown)):
            tab.press(key)
            visited.append(tab.evaluate("studio.cursor()"))
        assert set(visited) == shown
    tab.evaluate("studio.workbench.hideClass(0)")
    for key, regions in (("n", "All regions"), ("s", "All unlabeled regions")):
        tab.press("Escape", key)
        assert f"{regions} are hidden. U shows" in tab.status
        assert tab.evaluate("studio.cursor()") == -1
    tab.evaluate("studio.workbench.drawing.clip = null")


def test_an_export_is_what_was_painted_and_is_read_back(studio):
    _, tab = studio
    spots = tab.spots(2)
    for number, (_, x, y) in enumerate(spots, start=1):
        tab.press(str(number))
        tab.click(x, y)
    tab.settled()
    tab.locator("#export-what").select_option("cells")
    tab.locator("#export-format").select_option("npy")
    tab.locator("#export").click()
    tab.wait_for_status("Written: ")
    written = np.load(tab.status.removeprefix("Written: "))
    np.testing.assert_array_equal(written, tab.classes())
    with tab.page.expect_download() as download:
        tab.locator("#download").click()
    np.testing.assert_array_equal(np.load(download.value.path()), written)
    tab.press("Control+z", "Control+z")
    tab.locator("#export-old").wait_for()  # labels are compared when nothing changes for a while
    tab.press("Control+Shift+Z", "Control+Shift+Z")
    tab.locator("#export-old").wait_for(state="hidden")
    tab.press("Control+z", "Control+z")
    tab.settled()
    assert tab.locator("#undo").is_disabled()
    assert not tab.classes().any()
    tab.locator("#import").set_input_files(
        {"name": "back.npy", "mimeType": "", "buffer": download.value.path().read_bytes()}
    )
    tab.wait_for_status("Imported")
    np.testing.assert_array_equal(tab.classes(), written)


def test_a_folder_is_labeled_file_by_file_with_the_same_classes(serve, open_tab, tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    for name in ("a.ply", "b.ply"):
        write_mesh(folder / name, sample_mesh(3_000))
    (folder / "aa.ply").write_text("ply")
    (folder / "0.ply").write_text("ply")
    tab = open_tab(serve(folder, 30).address)
    assert tab.locator("#files button").count() == 4
    assert "0.ply" in tab.locator("#error span").text_content()
    tab.locator("input[aria-label^='Name of']").first.fill("head")
    tab.press("Enter")
    tab.until("document.querySelector('#brush-class').textContent.includes('head')")
    _, x, y = tab.spots(1)[0]
    tab.click(x, y)
    assert float(tab.locator("#files progress").nth(1).evaluate("bar => bar.value")) > 0
    tab.press("PageDown")
    tab.until("document.querySelector('#error span').textContent.includes('aa.ply')")
    tab.press("PageDown")
    tab.until("document.querySelector('#file-name').textContent === 'b.ply'")
    tab.settled()
    assert not tab.classes().any()
    assert tab.locator("input[aria-label^='Name of']").first.input_value() == "head"
    tab.locator("#files button").nth(1).click()
    tab.until("document.querySelector('#file-name').textContent === 'a.ply'")
    tab.until("studio.ready && studio.isIdle")
    assert tab.classes().any()


def _cells_of_all_kinds(folder):
    """Return a file of each kind of cells, with their number."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    corners += [[x, y, 1] for x, y, _ in corners]
    quads = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    bear = sample_mesh(3_000)
    np.savetxt(folder / "cloud.xyz", bear.vertices)
    write_mesh(folder / "cube.obj", PolygonMesh.of_faces(corners, quads))
    write_mesh(folder / "one.ply", Mesh(corners[:3], [[0, 1, 2]]))
    points = np.random.default_rng(3).normal(size=(90, 3))
    tets = spatial.Delaunay(points).simplices
    write_mesh(folder / "tets.vtu", TetMesh(points, tets))
    return {"cloud.xyz": len(bear.vertices), "cube.obj": 6, "one.ply": 1, "tets.vtu": len(tets)}


def test_all_kinds_of_cells_are_painted(serve, open_tab, tmp_path):
    kinds = _cells_of_all_kinds(tmp_path)
    server = serve(tmp_path, 6)
    colors = [entry["color"] for entry in server.state()["classes"]]
    tab = open_tab(server.address)
    for name, count in kinds.items():
        tab.until(f"document.querySelector('#file-name').textContent === '{name}'")
        tab.ready()
        assert len(tab.labels()) == count
        region, x, y = tab.spots(1)[0]
        tab.press("3")
        tab.click(x, y)
        tab.away()
        assert set(tab.classes()[tab.labels() == region]) == {3}
        np.testing.assert_allclose(tab.hue_at(x, y), hue(colors[2]), atol=0.04)

        tab.press("b", "1", "ArrowRight", "Enter")
        assert (tab.classes() == 1).nonzero()[0].tolist() == [tab.evaluate("studio.cellCursor()")]
        tab.press("Escape", "PageDown")


def test_tetrahedra_are_cut_by_keys(serve, open_tab, tmp_path):
    _cells_of_all_kinds(tmp_path)
    tab = open_tab(serve(tmp_path / "tets.vtu", 3).address)
    for n_regions in (4, 5):
        tab.press("s", "x", "Enter")
        tab.settled()
        assert tab.evaluate("studio.nRegions") == n_regions
        assert tab.status.endswith("is cut in two.")


def test_a_single_face_has_no_neighbor_to_go_to(serve, open_tab, tmp_path):
    _cells_of_all_kinds(tmp_path)
    tab = open_tab(serve(tmp_path / "one.ply", 6).address)
    tab.press("b", "ArrowUp", "ArrowUp")
    assert tab.status == "No triangle is in this direction."
    tab.press("h", "Escape", "h")
    assert "No region" in tab.status
    tab.press("b", "n", "h", "ArrowUp")
    assert tab.status == "No cell is visible."


def test_arrow_keys_go_from_face_to_face_where_one_looks(studio):
    server, tab = studio
    tab.locator("#canvas").focus()
    tab.press("b", "ArrowRight", "2", "Enter")
    first = tab.evaluate("studio.cellCursor()")
    assert tab.classes().nonzero()[0].tolist() == [first]
    assert tab.status.startswith(f"Triangle {first}: ")
    faces = sample_mesh(3_000).faces
    last, walked = first, {first}
    for key, axis, sign in [("ArrowRight", "x", 1)] * 8 + [("ArrowUp", "y", -1)] * 8:
        before = tab.evaluate("studio.screenOf(studio.cellCursor())")
        tab.press(key)
        cell = tab.evaluate("studio.cellCursor()")
        assert set(faces[cell]) & set(faces[last])
        after = tab.evaluate("studio.screenOf(studio.cellCursor())")
        assert sign * (after[axis] - before[axis]) > 0 or tab.evaluate(
            "Math.hypot(studio.screenOf(studio.cellCursor()).x - canvas.clientWidth / 2) < 2"
        )
        tab.press("Enter")
        last = cell
        walked.add(cell)
    assert len(walked) > 12
    assert set(tab.classes().nonzero()[0]) == walked
    tab.press("Delete")
    tab.settled()
    assert set(server.classes().nonzero()[0]) == walked - {last}


def test_the_wheel_waits_for_the_mesh(serve, context, bear, errors):
    page = context.new_page()
    held = []
    page.route("**/mesh", lambda route: held.append(route))  # noqa: PLW0108
    page.goto(serve(bear, 40).address)
    box = page.locator("#canvas").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    while not held:
        page.wait_for_timeout(20)
    page.mouse.wheel(0, 100)
    page.evaluate("new Promise(requestAnimationFrame)")
    held[0].continue_()
    Tab(page).ready()
    page.close()


def test_the_picture_comes_back_with_the_graphics_card(studio):
    _, tab = studio
    (_, *painted), (_, *hidden) = tab.spots(2)
    tab.press("2")
    tab.click(*painted)
    tab.page.mouse.move(*tab._on_page(*hidden))
    tab.press("h")
    tab.away()
    places = [painted, hidden]

    def seen():
        region = "([x, y]) => studio.regionAt(x, y)"  # the cell at an edge may change
        return [(tab.hue_at(*place), tab.evaluate(region, place)) for place in places]

    before = seen()
    tab.evaluate("""async () => {
        const card = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
        const happened = (name) => new Promise((done) => canvas.addEventListener(name, done));
        setTimeout(() => card.loseContext());
        await happened("webglcontextlost");
        setTimeout(() => card.restoreContext());
        await happened("webglcontextrestored");
    }""")
    for (hue_now, now), (hue_before, then) in zip(seen(), before, strict=True):
        np.testing.assert_allclose(hue_now, hue_before, atol=0.01)
        assert now == then


def test_the_brush_paints_one_side_of_a_body(studio):
    _, tab = studio
    _, x, y = tab.spots(1)[0]
    tab.press("b", "1", *["]"] * 6)
    tab.click(x, y)
    bear = sample_mesh(3_000)
    normals = np.cross(*np.diff(bear.vertices[bear.faces], axis=1).transpose(1, 0, 2))
    painted = tab.classes() == 1
    assert painted.sum() > 50
    under = normals[tab.evaluate("([x, y]) => studio.cellAt(x, y)", [x, y])]
    assert (normals[painted] @ under >= 0).all()
    middles = bear.vertices[bear.faces][painted].mean(axis=1)
    assert np.ptp(middles, axis=0).max() < 0.5 * np.ptp(bear.vertices, axis=0).max()


def test_two_tabs_show_the_same(studio, open_tab):
    server, tab = studio
    other = open_tab(server.address)
    _, x, y = tab.spots(1)[0]
    tab.click(x, y)
    tab.settled()
    other.evaluate("dispatchEvent(new Event('focus'))")  # as if the user went to that tab
    other.until("studio.workbench.session.state.can_undo && studio.isIdle")
    np.testing.assert_array_equal(other.classes(), tab.classes())
    other.press("2", "n", "Enter", "Control+z", "Control+z")
    other.settled()
    assert not server.classes().any()
    tab.evaluate("dispatchEvent(new Event('focus'))")
    tab.until("!studio.workbench.session.state.can_undo && studio.isIdle")
    assert not tab.classes().any()


def test_errors_are_one_line_and_the_page_goes_on(studio):
    server, tab = studio
    tab.locator("#import").set_input_files(
        {"name": "x.segs.json", "mimeType": "text/json", "buffer": b'{"a": 1}'}
    )
    tab.page.wait_for_selector("#error:not([hidden])")
    line = tab.locator("#error span").text_content()
    assert line
    assert "\n" not in line
    tab.locator("#error button").click()
    tab.press("n", "1", "Enter")
    tab.settled()
    assert server.classes().any()


def test_a_wrong_token_shows_no_mesh(serve, bear, browser):
    server = serve(bear, 40)
    with browser.new_page() as page:
        assert page.goto(server.address.replace("token=", "token=x")).status == 403


def test_a_file_leads_the_browser_to_the_page(shared, open_tab):
    server, _ = shared
    with redirection(server.address) as file:
        assert open_tab(file).page.url.startswith(server.address.split("?")[0])


def test_hints_are_seen_whole(bear, serve, open_tab):
    tab = open_tab(serve(bear, 40).address)
    for width in (800, 1100):
        tab.page.set_viewport_size({"width": width, "height": 460})
        for key in "vblx":
            tab.page.keyboard.press(key)
            is_whole = (
                "hint.scrollWidth <= hint.clientWidth && hint.scrollHeight <= hint.clientHeight"
            )
            assert tab.evaluate(is_whole), (width, key)
            assert tab.evaluate("mouse.offsetTop + mouse.offsetHeight <= bar.clientHeight")
        for scheme in ("blender", "meshlab", "studio"):
            tab.locator("#scheme").select_option(scheme)
            assert tab.evaluate("mouse.scrollHeight <= mouse.clientHeight"), (width, scheme)
