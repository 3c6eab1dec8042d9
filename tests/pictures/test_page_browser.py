"""Pages in a browser: they open from disk without a network, and respond to input."""

import base64

import numpy as np
import pytest

import superfacets as sf
from superfacets import PointCloud, hierarchy
from superfacets_show.colors import PALETTE, oklab

SIZE = {"width": 700, "height": 500}
MIDDLE = (250 + 450 / 2, 250)  # of the mesh, right of the panel


@pytest.fixture
def opened(browser, tmp_path):
    """Return a function that opens a page from disk, offline; script errors fail the test."""
    context = browser.new_context(viewport=SIZE, offline=True)
    errors = []

    def note(message):
        if "(OpenGL, Performance," not in message.text:  # a hint of the driver, not of the page
            errors.append(message.text)

    def open_page(page):
        page.save(tmp_path / "page.html")
        tab = context.new_page()
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.on("console", note)
        tab.goto((tmp_path / "page.html").as_uri())
        tab.wait_for_selector("html[data-state]", state="attached")
        assert tab.locator("#failure").text_content() == ""
        return tab

    yield open_page
    context.close()
    assert errors == []


def pixels(tab):
    """Return the pixels of the canvas after drawing has ended, (height, width, 4)."""
    draw = """() => {
        const { canvas, gpu: { gl } } = superfacets.drawing;
        superfacets.drawing.rest();
        superfacets.drawing.draw();
        const bytes = new Uint8Array(4 * canvas.width * canvas.height);
        gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        let text = "";
        for (const byte of bytes) text += String.fromCharCode(byte);
        return [canvas.height, canvas.width, btoa(text)];
    }"""
    height, width, text = tab.evaluate(draw)
    flat = np.frombuffer(base64.b64decode(text), np.uint8).astype(int)
    return flat.reshape(height, width, 4)[::-1]


def check_tinted(mixed, plain, own):
    """Check that a mixed color has the hue of the region and the mean lightness of both colors."""
    found = oklab(np.array([mixed, plain, own]))
    assert found[0, 0] == pytest.approx(found[1:, 0].mean(), abs=0.02)
    chroma = np.hypot(*found[:2, 1:].T)
    assert chroma[0] < chroma[1] + 0.01
    np.testing.assert_allclose(found[0, 1:] / chroma[0], found[1, 1:] / chroma[1], atol=0.1)


def hue_at(picture, x, y):
    """Return the color of a pixel without its brightness: fractions of red, green and blue."""
    color = picture[y, x, :3].astype(float)
    return color / color.sum()


def recolor(tab, colors):
    """Give regions other colors, three bytes each."""
    tab.evaluate(f"superfacets.content.levels[0].colors.set({colors}); superfacets.setLevel(0)")


@pytest.fixture(scope="module")
def levels(bear):
    return hierarchy(bear, [40, 8])


def tip(tab):
    tab.mouse.move(*MIDDLE)
    tab.mouse.move(MIDDLE[0] + 1, MIDDLE[1])
    tab.wait_for_selector("#tip:not([hidden])")
    return tab.locator("#tip").inner_text().split("\n")


def test_pointer_colors_levels_and_values(opened, bear, levels):
    truth = np.where(levels.levels[1] == 0, -1, 7)
    heights = bear.vertices[bear.faces, 1].mean(axis=1)
    tab = opened(
        sf.view(bear, levels, ground_truth=truth, features={"height": heights}, title="A <b>bear")
    )
    assert tab.title() == tab.locator("h1").text_content() == "A <b>bear"
    region, cells, area = tip(tab)
    label = int(region.removeprefix("region "))
    assert cells == f"{np.bincount(levels.levels[0])[label]:,} faces"
    areas = np.bincount(levels.levels[0], sf.build_face_graph(bear).measures)
    found = float(area.removeprefix("area ").replace(",", ""))
    assert found == pytest.approx(areas[label], rel=1e-3)

    tab.locator("#level").press("ArrowRight")
    assert tab.locator("#level-text").text_content() == "8 regions"
    assert int(tip(tab)[0].removeprefix("region ")) == levels.parents[0][label]

    tab.locator("#coloring").select_option("Ground truth")
    assert "1 part" in tab.locator("#regions-text").text_content()
    assert tip(tab)[0] in ("part 7", "no region")
    tab.locator("#coloring").select_option("height")
    assert tab.locator("#scale").is_visible()
    value = float(tip(tab)[3].removeprefix("height ").replace(",", ""))
    assert heights[levels.levels[0] == label].min() * 0.99 <= value
    assert value <= heights[levels.levels[0] == label].max() * 1.01


def test_sections_cut_and_the_search_goes_to_a_region(opened, bear, levels):
    def drawn():
        return np.count_nonzero(pixels(tab)[..., 3])

    tab = opened(sf.view(bear, levels.levels[0]))
    whole = drawn()
    halves = [tab.locator("#section").select_option(name) and drawn() for name in ("-x", "+x")]
    assert max(halves) < 0.8 * whole
    assert sum(halves) > 0.97 * whole
    tab.locator("#section").select_option("-z")
    cut = drawn()
    tab.locator("#inside").check()
    assert drawn() < 0.8 * cut  # the back of the bear is seen from inside
    tab.locator("#section").select_option("")
    tab.locator("#find").fill("7")
    tab.locator("#find").press("Enter")
    tab.wait_for_timeout(600)  # the flight
    assert tip(tab)[0] == "region 7"
    assert tab.locator("#status").text_content().startswith("region 7, ")
    assert tab.locator("#list li").count() == 40


def test_regions_have_the_colors_of_pictures_and_take_others(opened, bear):
    """With a single region, all drawn pixels have its color, until the color changes."""
    tab = opened(sf.view(bear, np.zeros(bear.n_faces, int)))
    before = pixels(tab)
    assert 0.1 < (before[..., 3] > 0).mean() < 0.9
    swatches = "[...document.querySelectorAll('#regions i:not([hidden])')]"
    first = tab.evaluate(f"{swatches}.map(swatch => swatch.style.background)")
    assert first == ["rgb({}, {}, {})".format(*PALETTE[0])]
    place = (225, 250)
    wanted = PALETTE[0] / PALETTE[0].astype(float).sum()
    np.testing.assert_allclose(hue_at(before, *place), wanted, atol=0.02)
    recolor(tab, "[0, 0, 255]")
    after = pixels(tab)
    np.testing.assert_allclose(hue_at(after, *place), [0, 0, 1], atol=0.02)
    np.testing.assert_array_equal(before[..., 3] > 0, after[..., 3] > 0)


def test_cells_left_out_are_gray_and_borders_can_be_hidden(opened, bear):
    half = (bear.vertices[bear.faces, 0].mean(axis=1) > bear.vertices[:, 0].mean()).astype(int)
    tab = opened(sf.view(bear, half - 1))
    picture = pixels(tab)
    shown = picture[..., 3] == 255
    is_gray = shown & (np.ptp(picture[..., :3], axis=2) <= 2) & (picture[..., 0] > 50)
    assert 0.2 < is_gray.sum() / shown.sum() < 0.8
    dark = (shown & (picture[..., :3].max(axis=2) < 40)).sum()
    tab.locator("#borders").uncheck()
    hidden = pixels(tab)
    assert dark > 50 + 2 * ((hidden[..., 3] == 255) & (hidden[..., :3].max(axis=2) < 40)).sum()
    assert "in no region" in tab.locator("#gray-text").text_content()


def test_drag_wheel_and_keys_move_the_mesh_and_0_brings_it_back(opened, bear, levels):
    tab = opened(sf.view(bear, levels.levels[1]))
    first = pixels(tab)

    def changed():
        return (np.abs(pixels(tab) - first).max(axis=2) > 30).mean()

    canvas = tab.locator("#canvas")
    tab.mouse.move(*MIDDLE)
    tab.mouse.down()
    tab.mouse.move(MIDDLE[0] + 80, MIDDLE[1] + 30)
    tab.mouse.up()
    assert changed() > 0.03
    canvas.press("0")
    assert changed() == 0
    tab.mouse.wheel(0, 300)
    tab.wait_for_function("() => superfacets.drawing.camera.zoom < 0.9")
    assert (pixels(tab)[..., 3] > 0).sum() < 0.8 * (first[..., 3] > 0).sum()
    canvas.press("0")
    for key in ("ArrowLeft", "Shift+ArrowUp", "+"):
        canvas.press(key)
        assert changed() > 0.02, key
        canvas.press("0")
        assert changed() == 0, key
    canvas.press("Enter")
    assert tab.locator("#status").text_content().startswith("region ")


def test_the_wheel_leaves_the_place_under_the_pointer_where_it_is(opened, bear, levels):
    tab = opened(sf.view(bear, levels.levels[1]))
    place = (MIDDLE[0] - 30, MIDDLE[1] - 40)
    tab.mouse.move(*place)
    cell = "superfacets.drawing.cellAt({{ x: {} - 250, y: {} }})".format(*place)
    before = tab.evaluate(cell)
    assert before < bear.n_faces
    for _ in range(3):
        tab.mouse.wheel(0, -200)
    tab.wait_for_function("() => superfacets.drawing.camera.zoom > 2.4")
    corners = bear.vertices[bear.faces[[before, tab.evaluate(cell)]]]
    size = np.linalg.norm(np.ptp(bear.vertices, axis=0))
    assert np.linalg.norm(corners[0].mean(axis=0) - corners[1].mean(axis=0)) < 0.02 * size


def test_two_fingers_zoom_and_move(opened, bear, levels):
    tab = opened(sf.view(bear, levels.levels[1]))
    session = tab.context.new_cdp_session(tab)

    def touch(kind, *xs):
        points = [{"x": x, "y": MIDDLE[1], "id": i} for i, x in enumerate(xs)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", MIDDLE[0] - 40, MIDDLE[0] + 40)
    touch("touchMove", MIDDLE[0] - 40, MIDDLE[0] + 80)
    touch("touchEnd")
    camera = tab.evaluate("superfacets.drawing.camera")
    assert camera["zoom"] == pytest.approx(1.5)
    assert np.linalg.norm(camera["target"]) > 0.01


def test_points_polygons_and_plain_meshes_are_shown(opened, bear):
    cloud = PointCloud(bear.vertices)
    labels = (cloud.points[:, 1] > cloud.points[:, 1].mean()).astype(int)
    tab = opened(sf.view(cloud, labels))
    assert (pixels(tab)[..., 3] > 0).mean() > 0.1
    region, points, _ = tip(tab)
    assert points == f"{np.bincount(labels)[int(region.removeprefix('region '))]:,} points"
    plain = opened(sf.view(bear))
    assert (pixels(plain)[..., 3] > 0).mean() > 0.1
    assert tip(plain)[0].startswith("face ")


def cells_seen(tab):
    """Return the cell at each position of a grid on the canvas, if there is one."""
    return tab.evaluate("""() => {
        const { drawing } = superfacets;
        const { clientWidth, clientHeight } = drawing.canvas;
        const found = [];
        for (let y = 5; y < clientHeight; y += 20) {
            for (let x = 5; x < clientWidth; x += 20) {
                const cell = drawing.cellAt({ x, y });
                if (cell !== 2 ** 32 - 1) found.push([x, y, cell]);
            }
        }
        return found;
    }""")


def test_each_pixel_has_the_color_of_the_cell_that_the_pointer_finds_there(opened, bear):
    """Cells in one half of the numbering are red. Cells share corners, but not numbers."""
    colors = np.arange(bear.n_faces) % 7
    tab = opened(sf.view(bear, colors))
    tab.locator("#borders").uncheck()
    recolor(tab, "[255, 0, 0, ...Array(6).fill([0, 0, 255]).flat()]")
    found = cells_seen(tab)
    picture = pixels(tab)
    assert len(found) > 60
    clear = [(x, y, cell) for x, y, cell in found if max(hue_at(picture, x, y)[[0, 2]]) > 0.9]
    assert len(clear) > 0.6 * len(found)  # the others are at borders of cells
    right = [(hue_at(picture, x, y)[0] > 0.5) == (colors[cell] == 0) for x, y, cell in clear]
    assert np.mean(right) > 0.97
    assert {colors[cell] == 0 for _, _, cell in clear} == {True, False}


def test_all_pointing_in_one_view_draws_cells_once(opened, bear, levels):
    tab = opened(sf.view(bear, levels.levels[1]))
    before = tab.evaluate("superfacets.drawing.stats.picks")
    first = cells_seen(tab)
    assert tab.evaluate("superfacets.drawing.stats.picks") == before + 1
    tab.locator("#canvas").press("ArrowLeft")
    other = cells_seen(tab)
    assert tab.evaluate("superfacets.drawing.stats.picks") == before + 2
    assert other != first
    tab.locator("#canvas").press("0")
    assert cells_seen(tab) == first


def test_a_slow_view_is_coarse_while_it_moves_and_fine_at_rest(opened, bear, levels):
    tab = opened(sf.view(bear, levels.levels[1]))
    fine = pixels(tab)
    size = "[superfacets.drawing.canvas.width, superfacets.drawing.canvas.height]"
    width, height = tab.evaluate(size)
    coarse = tab.evaluate(f"""() => {{
        const {{ drawing }} = superfacets;
        drawing.frameMs = 1000;
        drawing.move();
        drawing.draw();
        return {size};
    }}""")
    assert coarse == [round(width / 2), round(height / 2)]
    tab.wait_for_function(f"() => {size}[0] === {width} && !superfacets.drawing.isCoarse")
    np.testing.assert_array_equal(pixels(tab), fine)
    fast = tab.evaluate(f"""() => {{
        const {{ drawing }} = superfacets;
        drawing.frameMs = 5;
        drawing.move();
        drawing.draw();
        return {size};
    }}""")
    assert fast == [width, height]


def test_a_frame_sends_no_arrays_and_draws_in_two_calls(opened, bear, levels):
    tab = opened(sf.view(bear, levels))
    before, after = tab.evaluate("""() => {
        const { drawing } = superfacets;
        const before = { ...drawing.stats };
        for (let i = 0; i < 5; i++) {
            drawing.camera.orbit(0.1, 0);
            drawing.draw();
        }
        return [before, drawing.stats];
    }""")
    spent = {name: after[name] - before[name] for name in ("frames", "calls", "sentBytes", "picks")}
    assert spent == {"frames": 5, "calls": 10, "sentBytes": 0, "picks": 0}
