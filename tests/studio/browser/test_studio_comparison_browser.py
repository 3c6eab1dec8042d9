"""The table that compares two works follows all changes of labels."""

import json

import numpy as np
import pytest

from superfacets.studio.documents.document import Document


@pytest.fixture
def compared(serve, open_tab, bear, tmp_path):
    """A page with two labeled regions, of which the other work has the second one otherwise."""
    server = serve(bear, 40)
    tab = open_tab(server.address)
    spots = tab.spots(2)
    for _, x, y in spots:
        tab.click(x, y)
    tab.settled()
    document = Document.open(bear, tmp_path / "theirs.studio.jsonl", 40)
    for number, (region, _, _) in enumerate(spots, start=1):
        cells = np.flatnonzero(tab.labels() == region).astype(np.uint32)
        document.paint(cells, number, objects=1)
    document.close()
    tab.locator("#compare").set_input_files(tmp_path / "theirs.studio.jsonl")
    tab.page.wait_for_selector("#comparison:not([hidden])")
    return server, tab, spots


def shown(tab):
    """What the table says, once it is up to date."""
    tab.until("document.querySelector('#comparison').ariaBusy === 'false' && studio.isIdle")
    return tab.locator("#comparison p").text_content()


def said(server):
    """What a fresh comparison of the server gives."""
    found = json.loads(server.request("files/0/compare", data=b"{}"))["agreement"]
    return f"agree on {100 * found['share']:.1f} % of this part"


def hatched(tab):
    """Cells that are drawn as different."""
    return tab.evaluate("""() => {
        const { cells } = studio.workbench.drawing;
        return studio.labels().flatMap((_, cell) => (cells.marksOf(cell) & 16 ? [cell] : []));
    }""")


def test_the_table_follows_taken_labels_undo_and_strokes(compared):
    server, tab, (_, (second, *_)) = compared
    first = shown(tab)
    assert said(server) in first
    assert "100.0 %" not in first
    tab.press("d", "t")
    tab.wait_for_status("Their labels are taken")
    assert "agree on 100.0 %" in shown(tab)
    tab.press("Control+z")
    tab.wait_for_status("Undone")
    tab.press("d")  # at once: it compares again before it looks for a difference
    tab.wait_for_status(f"Region {second}")
    assert shown(tab) == first
    assert hatched(tab) == np.flatnonzero(tab.labels() == second).tolist()
    tab.press("2", "Enter")  # the label of the other work
    tab.wait_for_status(f"Region {second}: class 2")
    assert "agree on 100.0 %" in shown(tab)
    assert said(server) in shown(tab)
    assert hatched(tab) == []
    tab.press("d")
    tab.wait_for_status("There are no differences.")


def test_the_key_t_takes_labels_and_leaves_the_opacity_of_colors(compared):
    _, tab, _ = compared
    before = tab.evaluate("studio.workbench.drawing.blend.opacity")
    tab.press("t", "t")
    tab.settled()
    assert tab.evaluate("studio.workbench.drawing.blend.opacity") == before
    assert "texture" not in tab.status
