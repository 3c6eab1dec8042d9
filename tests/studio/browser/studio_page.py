"""A running studio, and functions that drive its page in tests."""

import json
import math
import queue
import subprocess
import sys
import threading
import urllib.request
from functools import partial
from pathlib import Path

import numpy as np
from studio_client import COMMAND

from superfacets_studio.documents.files import Files
from superfacets_studio.web.address import open_again
from superfacets_studio.web.server import serve

VIEW = {"viewport": {"width": 700, "height": 519}, "device_scale_factor": 0.5}
"""Few pixels, because each takes time without a graphics card."""

START_SECONDS = 60
WAIT_MS = 60_000
"""Timeout of waits, long because other processes may be running; most waits are short."""

READY = """window.studio && studio.ready && studio.isIdle
    && document.querySelector("#canvas").width
        === Math.floor(document.querySelector("#view").clientWidth * devicePixelRatio)"""

SCRIPT = Path(__file__).with_name("studio_page.js").read_text(encoding="utf-8")
"""Functions that the page gets, in the object `tests`."""


class Server:
    """A studio in a thread of this process."""

    def __init__(self, path, n_segments):
        files = Files.of(path, None, n_segments, ())
        opened, address = open_again(0, None)
        started = queue.Queue()

        def run():
            with opened:
                serve(files, opened, address, started.put)

        self.thread = threading.Thread(target=run)
        self.thread.start()
        self.address = started.get(timeout=START_SECONDS)

    def request(self, path, **options):
        """Return the bytes of the server's answer."""
        origin, token = self.address.split("/?token=")
        headers = {"X-Token": token, "Content-Type": "application/json"}
        request = urllib.request.Request(f"{origin}/api/{path}", headers=headers, **options)
        with urllib.request.urlopen(request, timeout=START_SECONDS) as answer:
            return answer.read()

    def classes(self):
        return np.frombuffer(self.request("files/0/paint"), "<u4").astype(np.uint16)

    def instances(self):
        """Return class * 1000 + object of each cell."""
        paint = np.frombuffer(self.request("files/0/paint"), "<u4")
        return (paint & 0xFFFF) * 1000 + (paint >> 16)

    def state(self):
        return json.loads(self.request("files/0/state"))

    def stop(self):
        self.request("quit", data=b"{}")
        self.thread.join(timeout=START_SECONDS)


class Command(Server):
    """The command, in another process. It can be restarted at the same address."""

    def __init__(self, path, n_segments, *options):
        given = [str(option) for option in (path, "--no-browser", "-n", n_segments, *options)]
        self.arguments = ["studio", *given]
        self.start()

    def start(self):
        self.process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, *self.arguments], stdout=subprocess.PIPE, text=True
        )
        lines = queue.Queue()
        threading.Thread(target=lambda: lines.put(self.process.stdout.readline())).start()
        words = lines.get(timeout=START_SECONDS).split()
        self.address = next(word for word in words if word.startswith("http://"))

    def kill(self):
        """Kill the process, so that it cannot save anything."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def stop(self):
        if self.process.poll() is None:
            self.kill()


class Tab:
    """A page of the browser, with what tests do to it."""

    def __init__(self, page):
        self.page = page
        self.locator = page.locator
        self.evaluate = page.evaluate

    def until(self, condition):
        """Wait until an expression of JavaScript is true."""
        self.page.wait_for_function(f"() => {condition}", timeout=WAIT_MS)

    def ready(self):
        self.until(READY)
        if self.locator("#welcome").is_visible():
            self.locator("#welcome-close").click()
        self.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
        # Antialiased pictures cost most of the time without a graphics card.
        self.evaluate("studio.workbench.drawing.refine = () => {}")
        self.evaluate(SCRIPT)
        return self

    def looks_from_one_side(self):
        """Let keys that go to a region look at it from one side, not eight, until the next test."""
        self.evaluate("""() => {
            const { camera } = studio.workbench.drawing;
            const { posesAround } = Object.getPrototypeOf(camera);
            camera.posesAround = (...of) => posesAround.apply(camera, of).slice(0, 1);
        }""")

    def settled(self):
        """Wait until no request is pending: the page then shows the state of the server."""
        self.until("studio.isIdle")

    def begin_anew(self):
        """Undo all work, and reset the view."""
        self.page.emulate_media(color_scheme="light")
        self.evaluate("tests.beginAnew()")
        self.press("Escape")
        self.away()
        self.settled()
        self.evaluate("document.querySelector('#status').textContent = ''")

    def press(self, *keys, until=None):
        """Press keys and, if `until` is given, wait for a status with these words."""
        for key in keys:
            self.page.keyboard.press(key)
        if until:
            self.wait_for_status(until)

    @property
    def status(self):
        return self.locator("#status").text_content()

    def wait_for_status(self, words):
        self.page.wait_for_function(
            "words => document.querySelector('#status').textContent.includes(words)",
            arg=words,
            timeout=WAIT_MS,
        )
        self.settled()

    def labels(self):
        return self._numbers("studio.labels()")

    def classes(self):
        return self._numbers("studio.labels().map((_, cell) => studio.classOf(cell))")

    def _numbers(self, script):
        """Return an array of JavaScript. Its JSON is passed because that takes less time."""
        return np.array(json.loads(self.evaluate(f"JSON.stringify({script})")))

    def spots(self, n):
        """Return (region, x, y), a place well inside each clearly visible region; None: all.

        Messages cover the lowest 60 pixels.
        """
        found = self.evaluate("tests.places()")
        seen = {}
        for region, x, y in found:
            seen.setdefault(region, []).append((x, y))
        largest = sorted(seen.items(), key=lambda pair: -len(pair[1]))[:n]
        assert n in (None, len(largest))

        def innermost(places):
            return min(places, key=partial(math.dist, np.mean(places, axis=0)))

        return [(region, *innermost(places)) for region, places in largest]

    def _on_page(self, x, y):
        box = self.locator("#canvas").bounding_box()
        return box["x"] + x, box["y"] + y

    def click(self, x, y, key=None):
        self.drag((x, y), key=key)

    def drag(self, *places, key=None):
        """Press at the first place, move over the others, and release, while a key is held."""
        if key:
            self.page.keyboard.down(key)
        self.page.mouse.move(*self._on_page(*places[0]))
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*self._on_page(*place), steps=3)
            self.evaluate("new Promise(requestAnimationFrame)")
        self.page.mouse.up()
        if key:
            self.page.keyboard.up(key)

    @property
    def corners(self):
        box = self.locator("#canvas").bounding_box()
        right, bottom = box["width"] - 2, box["height"] - 2
        return (2, 2), (right, 2), (right, bottom), (2, bottom)

    def away(self):
        """Move the pointer off the mesh, so that nothing is highlighted."""
        self.page.mouse.move(*self._on_page(3, 3))
        self.page.mouse.move(*self._on_page(2, 2))
        self.until("studio.workbench.hoveredCell === -1")

    def hue_at(self, x, y):
        """Return the shares of red, green and blue at a place, which do not depend on the light."""
        color = np.array(self.evaluate("([x, y]) => studio.pixelAt(x, y)", [x, y]), float)
        return color / color.sum()


def hue(color):
    """Return the shares of red, green and blue of a color such as #ff0000."""
    parts = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)], float)
    return parts / parts.sum()
