"""The table that compares two works follows all changes of labels."""

import json

import numpy as np
import pytest

from superfacets_studio.documents.document import Document


@pytest.fixture
def compare(serve, open_tab, bear, tmp_path):
    """Return a function that labels some of `n` regions, and compares with what `paint` paints."""

    def begin(n, n_mine, paint):
        server = serve(bear, 40)
        tab = open_tab(server.address)
        tab.looks_from_one_side()
        spots = tab.spots(n)
        for _, x, y in spots[:n_mine]:
            tab.click(x, y)
        tab.settled()
        document = Document.open(bear, tmp_path / "theirs.studio.jsonl", 40)
        cells = [np.flatnonzero(tab.labels() == region).astype("u4") for region, *_ in spots]
        paint(document, cells)
        document.close()
        tab.locator("#compare").set_input_files(tmp_path / "theirs.studio.jsonl")
        tab.page.wait_for_selector("#comparison:not([hidden])")
        return server, tab, spots

    return begin


@pytest.fixture
def compared(compare):
    """Return a page with two labeled regions, one of which has another label in the other work."""

    def paint(document, regions):
        for number, cells in enumerate(regions, start=1):
            document.paint(cells, number, objects=1)

    return compare(2, 2, paint)


def shown(tab):
    """Return the text of the table once it is up to date."""
    tab.until("document.querySelector('#comparison').ariaBusy === 'false' && studio.isIdle")
    return tab.locator("#comparison p").text_content()


def said(server):
    """Return the sentence for the result of a new comparison by the server."""
    found = json.loads(server.request("files/0/compare", data=b"{}"))["agreement"]
    return f"agree on {100 * found['share']:.1f} % of this part"


def hatched(tab):
    """Return the cells that are drawn as different."""
    return tab.evaluate("""() => {
        const { cells } = studio.workbench.drawing;
        return studio.labels().flatMap((_, cell) => (cells.marksOf(cell) & 16 ? [cell] : []));
    }""")


def test_the_table_follows_taken_labels_undo_and_strokes(compared):
    server, tab, (_, (second, *_)) = compared
    first = shown(tab)
    assert said(server) in first
    assert "100.0 %" not in first
    tab.press("d", "t", until="Their labels are taken")
    assert "agree on 100.0 %" in shown(tab)
    tab.press("Control+z", until="Undone")
    tab.press("d")  # immediately: the page compares again before it searches
    tab.wait_for_status(f"Region {second}")
    assert shown(tab) == first
    assert hatched(tab) == np.flatnonzero(tab.labels() == second).tolist()
    tab.press("2", "Enter", until=f"Region {second}: class 2")  # the label of the other work
    assert "agree on 100.0 %" in shown(tab)
    assert said(server) in shown(tab)
    assert hatched(tab) == []
    tab.press("d", until="There are no differences.")


def test_the_table_says_which_objects_only_one_work_has(compare):
    _, tab, _ = compare(2, 1, lambda document, regions: document.paint(regions[1], 1, objects=7))
    assert tab.locator("#comparison tr.part").all_text_contents() == [
        "class 1 1 (only mine)-",
        "class 1 2 (only theirs)-",
    ]


def test_a_file_that_is_not_a_work_file_is_named_as_it_is(compared, tmp_path):
    _, tab, _ = compared
    first, status = shown(tab), tab.status
    (tmp_path / "other.jsonl").write_text("{}")
    tab.locator("#compare").set_input_files(tmp_path / "other.jsonl")
    tab.page.wait_for_selector("#error:not([hidden])")
    tab.settled()
    assert tab.locator("#error span").text_content().startswith("other.jsonl: is not a work file")
    assert (shown(tab), tab.status) == (first, status)


def test_the_key_t_takes_labels_and_leaves_the_opacity_of_colors(compared):
    _, tab, _ = compared
    before = tab.evaluate("studio.workbench.drawing.blend.opacity")
    tab.press("t", "t")
    tab.settled()
    assert tab.evaluate("studio.workbench.drawing.blend.opacity") == before
    assert "texture" not in tab.status


def tip(tab):
    return tab.locator("#tip").text_content().splitlines()


def test_the_tip_tells_both_labels_of_the_cell_under_the_pointer(compared):
    _, tab, spots = compared
    shown(tab)
    tab.press("Home")
    for (region, x, y), theirs in zip(spots, ("class 1 #1", "class 2 #1"), strict=True):
        tab.page.mouse.move(*tab._on_page(x, y))
        tab.until(f"studio.workbench.regionOf(studio.workbench.hoveredCell) === {region}")
        assert tip(tab)[-2:] == ["Mine: class 1 #1", f"Theirs: {theirs}"]
    tab.press("t", until="Their labels are taken")
    assert tip(tab)[-2:] == ["Mine: class 2 #1", "Theirs: class 2 #1"]
    tab.press("Delete")
    tab.settled()
    assert tip(tab)[-2:] == ["Mine: No class", "Theirs: class 2 #1"]


@pytest.fixture
def differing(compare):
    """Return a page with four regions, largest first, all of another class in the other work."""
    areas = []

    def paint(document, regions):
        document.paint(np.sort(np.concatenate(regions)), 3, objects=1)
        areas.extend(document.areas[cells].sum() for cells in regions)

    _, tab, spots = compare(4, 4, paint)
    tab.wait_for_status("difference 1 of 4: mine class 1 #1, theirs class 3 #1")
    return tab, [spots[place][0] for place in np.argsort(areas)[::-1]]


def test_each_next_difference_is_a_further_one_until_all_were_shown(differing):
    tab, (first, second, third, fourth) = differing
    assert tab.evaluate("studio.cursor()") == first
    tab.press("d", until=f"Region {second}, difference 2 of 4")
    tab.press("t", until="Their labels are taken")
    tab.press("d", until=f"Region {third}, difference 2 of 3")
    tab.press("y", until="Your labels are kept")
    tab.press("d", until=f"Region {fourth}, difference 2 of 2")
    tab.press("d", until=f"All differences were shown; this is the largest again. Region {first}")
    tab.press("d", until=f"Region {fourth}")
    assert "again" not in tab.status


def test_differences_in_hidden_regions_are_left_out(differing):
    tab, (first, second, third, fourth) = differing
    for region in (second, third):
        tab.evaluate(f"studio.workbench.setCursor({region})")
        tab.press("h")
    tab.press("d", until=f"Region {fourth}, difference 2 of 2")
    for region in (first, fourth):
        tab.evaluate(f"studio.workbench.setCursor({region})")
        tab.press("h")
    tab.press("d", until="All differences are hidden. U shows")
