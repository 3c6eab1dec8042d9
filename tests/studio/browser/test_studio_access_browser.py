"""The page has no serious problem of access, and stays usable with many classes and files."""

from pathlib import Path

import pytest
from studio_page import READY, Tab

from superfacets import sample_mesh, write_mesh
from superfacets_studio.labels.classes import CLASSES_FILE, default_classes, write_classes

AXE = Path(__file__).parents[3] / "frontend/node_modules/axe-core/axe.min.js"
PROBLEMS = """axe.run().then(({ violations }) => violations.flatMap(({ id, impact, nodes }) =>
    (/serious|critical/.test(impact) ? nodes.map(({ html }) => `${id}: ${html}`) : [])))"""
COVERED = """[...document.querySelectorAll(
    "#bar button, #mouse, #add-class, #new-object, #undo, #next-bare, #export-title, #next-file"
)].filter((one) => {
    const { x, y, width, height, right } = one.getBoundingClientRect();
    const top = document.elementFromPoint(x + width / 2, y + height / 2);
    return right > innerWidth || !one.contains(top);
}).map(({ outerHTML }) => outerHTML)"""


def test_axe_finds_no_serious_problem(studio):
    if not AXE.is_file():
        pytest.skip("axe-core is not installed")
    _, tab = studio
    tab.evaluate(AXE.read_text(encoding="utf-8"))
    for scheme in ("light", "dark"):
        tab.page.emulate_media(color_scheme=scheme)
        for number, (_, x, y) in enumerate(tab.spots(2), 1):
            tab.press(str(number))
            tab.click(x, y)
        tab.settled()
        assert tab.evaluate(PROBLEMS) == []
        for key in ("/", "?"):
            tab.press(key)
            assert tab.evaluate(PROBLEMS) == []
            tab.press("Escape")


def test_a_hundred_classes_and_ten_files_fit_and_the_chosen_class_survives_a_reload(
    serve, context, errors, tmp_path
):
    for number in range(10):
        write_mesh(tmp_path / f"a_scan_with_a_long_name_{number}.ply", sample_mesh(3_000))
    classes = default_classes([f"kind {number}" for number in range(100)])
    write_classes(tmp_path / CLASSES_FILE, classes)
    page = context.new_page()
    tab = Tab(page)
    page.goto(serve(tmp_path, 20).address)
    for width, height in ((1100, 700), (800, 600)):
        page.set_viewport_size({"width": width, "height": height})
        tab.until(READY)
        assert tab.evaluate(COVERED) == []
        assert tab.evaluate("document.querySelector('#view').clientHeight") > 0.6 * height
    tab.press("/")
    page.keyboard.type("76")
    tab.press("ArrowDown", "Enter", "b")
    assert tab.status.startswith("kind 76 #1 is chosen")
    page.reload()
    tab.until(READY)
    assert tab.evaluate("document.querySelector('#brush-class b').textContent") == "kind 76 #1"
    assert tab.evaluate("document.querySelector('[aria-pressed=true]').textContent") == "Brush"
    page.close()
