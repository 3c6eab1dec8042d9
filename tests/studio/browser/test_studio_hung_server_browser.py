"""Nothing is lost or painted wrongly while the server hangs or answers late."""

import signal

import numpy as np
import pytest

STOP, GO = getattr(signal, "SIGSTOP", None), getattr(signal, "SIGCONT", None)

hanging = pytest.mark.skipif(STOP is None, reason="needs a signal that stops a process")


@pytest.fixture
def hang(command):
    """Return a function that makes the server of `command` hang, as on a stalled disk."""
    server, _ = command
    yield lambda: server.process.send_signal(STOP)
    if server.process.poll() is None:
        server.process.send_signal(GO)


def paint(tab, spots):
    for number, (_, x, y) in enumerate(spots, start=1):
        tab.press(str(number))
        tab.click(x, y)


def paints_in(path):
    """Return the number of lines of the work file that paint."""
    return path.with_name(f"{path.name}.studio.jsonl").read_text().count('"op":"paint"')


def classes_of(tab, classes, spots):
    return [set(classes[tab.labels() == region]) for region, *_ in spots]


def delayed(tab, name):
    """Hold the next request of an operation, and return a function that lets it go on."""
    held = []
    tab.page.route(f"**/{name}", lambda route: held.append(route))  # noqa: PLW0108

    def answer():
        while not held:
            tab.page.wait_for_timeout(20)
        held[0].continue_()
        tab.page.unroute(f"**/{name}")

    return answer


@hanging
def test_six_strokes_of_a_closed_tab_are_saved_when_the_hung_server_goes_on(
    command, hang, open_tab, bear
):
    server, tab = command
    spots = tab.spots(6)
    hang()
    paint(tab, spots)
    assert tab.locator("#saved").text_content() == "Saving …"
    asked = []

    def leave(dialog):
        asked.append(dialog.type)
        dialog.accept()

    tab.page.on("dialog", leave)
    with tab.page.expect_event("close"):
        tab.page.close(run_before_unload=True)
    assert asked == ["beforeunload"]
    server.process.send_signal(GO)
    again = open_tab(server.address)
    wanted = [{number} for number in range(1, 7)]
    assert classes_of(again, server.classes(), spots) == wanted
    assert classes_of(again, again.classes(), spots) == wanted
    assert paints_in(bear) == 6
    left = "Object.keys(localStorage).filter((key) => /^superfacets (?!place).*jsonl/.test(key))"
    assert again.evaluate(left) == []


@hanging
def test_a_hung_server_shows_the_banner_after_ten_seconds_and_is_tried_again(command, hang):
    server, tab = command
    spots = tab.spots(3)
    tab.page.clock.install()
    hang()
    began = tab.evaluate("Date.now()")
    paint(tab, spots)
    while tab.evaluate("Date.now()") - began < 20_000 and tab.locator("#banner").is_hidden():
        tab.page.clock.fast_forward(500)
    assert 9_000 < tab.evaluate("Date.now()") - began < 20_000
    assert "does not answer. 3 unsaved strokes" in tab.locator("#banner").text_content()
    tab.press("Control+z")
    tab.until("document.querySelector('#status').textContent.includes('so undo has to wait')")
    server.process.send_signal(GO)
    tab.settled()
    assert tab.locator("#banner").is_hidden()
    assert classes_of(tab, server.classes(), spots) == [{1}, {2}, {3}]
    np.testing.assert_array_equal(tab.classes(), server.classes())


def test_similar_regions_get_the_class_that_was_chosen_when_f_was_pressed(studio):
    server, tab = studio
    region, x, y = tab.spots(1)[0]
    answer = delayed(tab, "similar")
    tab.press("1")
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until(f"studio.workbench.activeRegion === {region}")
    tab.press("f", "2", "k")
    answer()
    tab.wait_for_status("similar region")
    tab.press("k")
    assert set(server.classes()) == {0, 1}
    assert set(tab.classes()[tab.labels() == region]) == {1}


def test_a_region_painted_after_f_was_pressed_keeps_its_class(studio):
    server, tab = studio
    region, x, y = tab.spots(1)[0]
    answer = delayed(tab, "similar")
    tab.page.mouse.move(*tab._on_page(x, y))
    tab.until(f"studio.workbench.activeRegion === {region}")
    tab.press("1", "f", "2")
    tab.click(x, y)
    answer()
    tab.wait_for_status("nothing was painted")
    assert set(server.classes()) == {0, 2}


def test_ctrl_click_on_an_unlabeled_cell_chooses_nothing_else(studio):
    _, tab = studio
    _, x, y = tab.spots(1)[0]
    tab.press("2")
    chosen = tab.evaluate("studio.workbench.currentPaint")
    tab.click(x, y, key="Control")
    assert "has no class" in tab.status
    assert tab.evaluate("studio.workbench.currentPaint") == chosen
