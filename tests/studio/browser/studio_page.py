"""A studio in a process of its own, and its page as tests drive it."""

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import urllib.request

import numpy as np

TOKEN = "a-token-that-two-servers-have-in-common"
START_SECONDS = 60


class Server:
    """The command in a process of its own. A second start answers at the same address."""

    def __init__(self, path, *options):
        self.path, self.options, self.port = path, options, 0
        self.start()

    def start(self):
        command = [sys.executable, "-m", "superfacets", "studio", self.path, "--no-browser"]
        environment = {**os.environ, "SUPERFACETS_STUDIO_TOKEN": TOKEN}
        self.process = subprocess.Popen(
            [*command, "--port", str(self.port), *self.options],
            stdout=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        lines = queue.Queue()
        reader = threading.Thread(target=lambda: lines.put(self.process.stdout.readline()))
        reader.start()
        line = lines.get(timeout=START_SECONDS)
        self.address = next(word for word in line.split() if word.startswith("http://"))
        self.port = int(self.address.split(":")[2].split("/")[0])

    def get(self, path):
        """Bytes that the server answers with."""
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}/api/files/0/{path}", headers={"X-Token": TOKEN}
        )
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.read()

    def classes(self):
        return np.frombuffer(self.get("classes"), "<u2")

    def state(self):
        return json.loads(self.get("state"))

    def kill(self):
        """No chance to save anything."""
        self.process.kill()
        self.process.wait()

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self.kill()
        self.process.stdout.close()


class Tab:
    """A page of the browser, as the tests need it."""

    def __init__(self, page):
        self.page = page
        self.locator = page.locator
        self.evaluate = page.evaluate

    def until(self, condition):
        """Wait for an expression of JavaScript to be true."""
        self.page.wait_for_function(f"() => {condition}", timeout=20_000)

    def ready(self):
        self.until("window.studio && studio.ready")
        return self

    def press(self, *keys):
        for key in keys:
            self.page.keyboard.press(key)

    @property
    def status(self):
        return self.locator("#status").text_content()

    def wait_for_status(self, words):
        self.page.wait_for_function(
            "words => document.querySelector('#status').textContent.includes(words)", arg=words
        )

    def labels(self):
        return np.array(self.evaluate("studio.labels()"))

    def classes(self):
        return np.array(self.evaluate("studio.labels().map((_, cell) => studio.classOf(cell))"))

    def spots(self, n):
        """Regions that are well seen, with a place well inside each: (region, x, y)."""
        found = self.evaluate(
            """n => {
                const { clientWidth, clientHeight } = document.querySelector("#canvas");
                const seen = new Map();
                for (let y = 4; y < clientHeight; y += 8) {
                    for (let x = 4; x < clientWidth; x += 8) {
                        const region = studio.regionAt(x, y);
                        if (region < 0) continue;
                        if (!seen.has(region)) seen.set(region, []);
                        seen.get(region).push([x, y]);
                    }
                }
                const largest = [...seen].sort((a, b) => b[1].length - a[1].length).slice(0, n);
                return largest.map(([region, places]) => {
                    const [sx, sy] = places.reduce(([u, v], [x, y]) => [u + x, v + y], [0, 0]);
                    const off = ([x, y]) =>
                        Math.hypot(x - sx / places.length, y - sy / places.length);
                    const [x, y] = places.reduce((a, b) => (off(a) <= off(b) ? a : b));
                    return [region, x, y];
                });
            }""",
            n,
        )
        assert len(found) == n
        return [tuple(spot) for spot in found]

    def _on_page(self, x, y):
        box = self.locator("#canvas").bounding_box()
        return box["x"] + x, box["y"] + y

    def click(self, x, y):
        self.page.mouse.click(*self._on_page(x, y))

    def drag(self, *places):
        """Press at the first place, move over the others, let go."""
        self.page.mouse.move(*self._on_page(*places[0]))
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*self._on_page(*place), steps=3)
            self.evaluate("new Promise(requestAnimationFrame)")
        self.page.mouse.up()

    def away(self):
        """The pointer to where nothing is, so that nothing is highlighted."""
        self.page.mouse.move(*self._on_page(2, 2))
        self.evaluate("new Promise(done => setTimeout(done, 50))")

    def hue_at(self, x, y):
        """The color at a place, whatever the light: its share of red, green and blue."""
        color = np.array(self.evaluate("([x, y]) => studio.pixelAt(x, y)", [x, y]), float)
        return color / color.sum()


def hue(color):
    """The same of a color such as #ff0000."""
    parts = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)], float)
    return parts / parts.sum()
