"""Names, keys and messages, used as by someone who labels a first room."""

import numpy as np
import pytest


@pytest.fixture
def desk(studio):
    """Return a server and its page, in a window wide enough for whole names."""
    _, tab = studio
    tab.page.set_viewport_size({"width": 1000, "height": 560})
    tab.ready()
    return studio


def name_of(tab, number):
    return tab.locator(f"#classes input[aria-label='Name of {number}']")


def names(server):
    return [entry["name"] for entry in server.state()["classes"]]


def test_names_are_typed_over_one_after_the_other_and_enter_paints_nothing(desk):
    server, tab = desk
    tab.press("s")  # a region of the mesh is selected
    name_of(tab, "class 1").click()  # in the middle of the word
    tab.page.keyboard.type("floor")
    tab.press("Enter")
    name_of(tab, "class 2").click()  # perhaps before the server has answered
    tab.page.keyboard.type("chair")
    tab.press("Enter", "Enter", "Delete", "f")
    assert tab.status.startswith("Nothing was painted")
    tab.settled()
    name_of(tab, "class 3").click()
    tab.page.keyboard.type("no name")
    tab.press("Escape")
    assert name_of(tab, "class 3").input_value() == "class 3"
    name_of(tab, "class 3").click()
    tab.page.keyboard.type("desk")
    tab.press("Tab")
    tab.settled()
    assert names(server)[:3] == ["floor", "chair", "desk"]
    focused = "document.activeElement.ariaLabel"  # also after the list is rebuilt
    tab.until(f"{focused}?.startsWith('stuff: Make desk')")
    assert not server.classes().any()

    tab.evaluate("studio.workbench.session.savedAt = null")
    name_of(tab, "desk").click()
    tab.page.keyboard.type("table")
    tab.press("Enter")
    tab.settled()
    assert tab.locator("#saved").text_content().startswith("Saved ")
    tab.press("Control+z", until="Undone: renamed desk to table.")


def test_a_new_class_is_named_at_once(desk):
    server, tab = desk
    before = names(server)
    tab.locator("#add-class").click()
    new = f"class {len(before) + 1}"
    tab.until(f"document.activeElement.ariaLabel === 'Name of {new}'")
    tab.page.keyboard.type("2 lamps")
    tab.press("Enter", "Enter")
    tab.settled()
    assert names(server) == [*before, "2 lamps"]
    tab.press("Control+z", "Control+z", until=f"Undone: new class {new}.")


def test_a_list_gives_the_keys_back_and_the_number_pad_turns_the_view_as_in_blender(desk):
    _, tab = desk
    scheme = tab.locator("#scheme")
    scheme.click()
    tab.press("ArrowDown", "Enter")
    tab.until("document.activeElement.id === 'canvas'")
    assert scheme.input_value() == "blender"
    assert "B brush, X split, L lasso" in tab.status
    chosen = "studio.workbench.currentPaint"
    paint = tab.evaluate(chosen)
    angles = "(({ azimuth, elevation }) => [azimuth, elevation])(studio.workbench.drawing.camera)"
    pressed = {"Numpad7": [0, 90], "Numpad2": [0, 75], "Numpad4": [-15, 75], "Numpad6": [0, 75]}
    for key, wanted in pressed.items():
        tab.press(key)
        assert np.degrees(tab.evaluate(angles)) == pytest.approx(wanted, abs=1e-6)
    tab.press("Numpad5")
    assert "only a perspective view" in tab.status
    assert tab.evaluate(chosen) == paint
    tab.press("2")
    assert tab.evaluate(chosen) != paint
    scheme.select_option("studio")


def test_an_empty_view_and_a_card_of_another_view(desk):
    _, tab = desk
    _, x, y = tab.spots(1)[0]
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until("!document.querySelector('#tip').hidden")
    tab.press("Alt+1")
    assert tab.locator("#tip").is_hidden()
    tab.evaluate("studio.workbench.drawing.camera.pan(3, 0)")
    tab.wait_for_status("No cell is in view. G shows the chosen region or object, Home")
    tab.locator("#views button", has_text="Reset").click()
    tab.until("document.querySelector('#status').textContent === ''")
    toward = "JSON.stringify(studio.workbench.drawing.camera.directions()[2])"
    first = tab.evaluate(toward)
    tab.locator("#help-button").focus()  # as after a click on a button
    tab.press("ArrowLeft")
    assert tab.evaluate(toward) != first
    tab.press("Home")
    tab.until(f"{toward} === {first!r}")
    tab.locator("#least-score, #tolerance").last.focus()
    tab.press("ArrowLeft", "Home")  # move the slider
    assert tab.evaluate(toward) == first


def test_strokes_say_what_they_replace_and_undo_what_it_reverts(desk):
    server, tab = desk
    (first, *a), (second, *b) = tab.spots(2)
    tab.press("2")
    tab.click(*a)
    tab.press("1")
    tab.drag(a, b)
    n = len(set(tab.labels()[tab.classes() == 1]))
    assert f"{n} regions: class 1 #1. 1 of them was class 2 #1; K:" in tab.status
    tab.press("Control+z", until=f"Undone: {n} regions class 1 #1.")
    assert set(tab.classes()[tab.labels() == first]) == {2}
    assert not tab.classes()[tab.labels() == second].any()
    tab.press("Control+Shift+Z", until=f"Redone: {n} regions class 1 #1.")
    np.testing.assert_array_equal(server.classes(), tab.classes())


def test_a_download_is_named(desk):
    _, tab = desk
    tab.locator("#export-what").select_option("cells")
    tab.locator("#export-format").select_option("npy")
    assert tab.locator("#export-name").text_content() == "bear.classes.npy"
    with tab.page.expect_download() as download:
        tab.locator("#download").click()
    assert download.value.suggested_filename == "bear.classes.npy"
    assert tab.status == "Downloaded: bear.classes.npy"
