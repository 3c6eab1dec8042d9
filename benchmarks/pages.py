"""Size, memory and times of a page of ``superfacets.view`` in a browser.

    python -m benchmarks page scan.ply
    python -m benchmarks page bear60k-x16 --segments 2000
    python -m benchmarks page 2000000    # a torus with knobs, of this number of faces

Playwright and Chromium are needed. Without a graphics card, Chromium draws in software, so that the
number of frames per second depends on the processor. The milliseconds of scripts, the number of
draw calls and the bytes do not depend on the speed of drawing.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from research.table_writer import markdown_table

import superfacets as sf

OPTIONS = [
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox",
    "--enable-precise-memory-info",
]  # fmt: skip
SIZE: Any = {"width": 1280, "height": 800}

START_MS = 300_000
"""Time limit in milliseconds for opening a page. On a busy machine, opening a page with millions of
faces takes long."""

# JavaScript that turns the view as if the user dragged it, by one step per frame. The script waits
# until each frame is drawn.
ORBIT = """async ([frames, isFine]) => {
    const { drawing } = superfacets;
    const drawn = () => drawing.gpu.read(0, 0, 1, 1);
    const frameMs = drawing.frameMs;
    drawing.frameMs = 0; // turning would make a slow view coarse
    drawing.isCoarse = !isFine;
    drawing.draw();
    drawn();
    const before = { ...drawing.stats };
    const start = performance.now();
    for (let i = 0; i < frames; i++) {
        drawing.camera.orbit(0.05, 0);
        drawing.draw();
        drawn();
    }
    const seconds = (performance.now() - start) / 1000;
    const spent = (name) => (drawing.stats[name] - before[name]) / frames;
    const found = {
        fps: frames / seconds, script_ms: spent("scriptMs"), calls: spent("calls"),
        sent_bytes: spent("sentBytes"),
    };
    drawing.isCoarse = false;
    drawing.frameMs = frameMs;
    drawing.draw();
    drawn();
    return found;
}"""

HOVER = """(n) => {
    const { drawing } = superfacets;
    const { clientWidth, clientHeight } = drawing.canvas;
    const picks = drawing.stats.picks;
    drawing.draw();
    drawing.gpu.read(0, 0, 1, 1); // waits for frames that are under way
    const timed = (x) => {
        const start = performance.now();
        drawing.cellAt({ x, y: clientHeight / 2 });
        return performance.now() - start;
    };
    const first = timed(clientWidth / 2);
    let others = 0;
    for (let i = 0; i < n; i++) others += timed(clientWidth / 2 + i);
    return { first_ms: first, next_ms: others / n, picks: drawing.stats.picks - picks };
}"""

FACTS = """() => {
    const { drawing } = superfacets;
    return {
        gpu_bytes: drawing.gpuBytes, corners: drawing.nCorners, borders: drawing.nEdges,
        pixels: drawing.canvas.width * drawing.canvas.height,
        renderer: drawing.gpu.gl.getParameter(drawing.gpu.gl.RENDERER),
    };
}"""


def knobby_torus(n_faces: int) -> sf.Mesh:
    """Return a torus with knobs: a closed grid of at least `n_faces` triangles."""
    n = max(3, int(np.ceil(np.sqrt(n_faces / 2))))
    u, v = np.meshgrid(*[np.arange(n) * (2 * np.pi / n)] * 2, indexing="ij")
    radii = 0.4 + 0.05 * np.sin(12 * u) * np.sin(5 * v)
    across = 1 + radii * np.cos(v)
    points = np.stack([across * np.cos(u), radii * np.sin(v), across * np.sin(u)], axis=-1)
    numbers = np.arange(n * n).reshape(n, n)
    a, b = numbers, np.roll(numbers, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    faces = np.stack([np.stack([a, c, b], -1), np.stack([a, d, c], -1)], axis=2)
    return sf.Mesh(points.reshape(-1, 3), faces.reshape(-1, 3).astype(np.int32))


def measure_page(mesh: sf.Mesh | sf.PolygonMesh, n_segments: int, frames: int) -> dict[str, Any]:
    """Return the sizes, memory and times of the page of a mesh with `n_segments` regions.

    Raises
    ------
    ImportError
        If Playwright is not installed.
    ValueError
        If there is no Chromium.
    """
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        raise ValueError("Chromium was not found: run tools/ensure-chromium")
    labels = sf.segment(mesh, n_segments).labels
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        start = time.perf_counter()
        file = sf.view(mesh, labels).save(Path(folder, "page.html"))
        facts = {
            "faces": mesh.n_faces, "regions": int(labels.max()) + 1,
            "page_bytes": file.stat().st_size, "write_seconds": time.perf_counter() - start,
        }  # fmt: skip
        browser = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        try:
            tab = browser.new_page(viewport=SIZE)
            tab.set_default_timeout(START_MS)
            return facts | _in_browser(tab, file, frames)
        finally:
            browser.close()


def _in_browser(tab: Any, file: Path, frames: int) -> dict[str, Any]:
    start = time.perf_counter()
    tab.goto(file.as_uri(), timeout=START_MS)
    tab.wait_for_selector("html[data-state]", state="attached")
    tab.evaluate("superfacets.drawing.gpu.gl.finish()")
    found: dict[str, Any] = {"first_frame_seconds": time.perf_counter() - start}
    found |= tab.evaluate(FACTS)
    found["fine"] = tab.evaluate(ORBIT, [frames, True])
    found["moving"] = tab.evaluate(ORBIT, [frames, False])
    found["hover"] = tab.evaluate(HOVER, 20)
    session = tab.context.new_cdp_session(tab)
    session.send("HeapProfiler.collectGarbage")
    arrays = "Object.values(superfacets.content.arrays).reduce((n, a) => n + a.byteLength, 0)"
    found["heap_bytes"] = tab.evaluate("performance.memory.usedJSHeapSize")
    found["array_bytes"] = tab.evaluate(arrays)
    return found


def page_table(found: dict[str, Any]) -> str:
    """Return the results as a table in Markdown."""
    megabytes = {
        "size of the file": "page_bytes", "buffers and textures": "gpu_bytes",
        "JavaScript heap": "heap_bytes", "arrays in the heap": "array_bytes",
    }  # fmt: skip
    rows = [("faces; regions", f"{found['faces']:,}; {found['regions']:,}")]
    rows += [(name, f"{found[key] / 1e6:.1f} MB") for name, key in megabytes.items()]
    rows += [
        ("time to write the page", f"{found['write_seconds']:.1f} s"),
        ("time until the first frame", f"{found['first_frame_seconds']:.1f} s"),
    ]
    for name in ("fine", "moving"):
        part = found[name]
        rows += [
            (f"{name}: frames per second", f"{part['fps']:.1f}"),
            (f"{name}: script per frame", f"{part['script_ms']:.2f} ms"),
            (f"{name}: calls that draw, per frame", f"{part['calls']:.0f}"),
            (f"{name}: bytes of arrays sent per frame", f"{part['sent_bytes']:.0f}"),
        ]
    hover = found["hover"]
    rows += [
        ("first pointing in a view", f"{hover['first_ms']:.0f} ms"),
        ("pointing again", f"{hover['next_ms']:.2f} ms"),
        ("corners; border edges", f"{found['corners']:,}; {found['borders']:,}"),
        ("drawn by", found["renderer"]),
    ]
    return markdown_table(["what", ""], rows)
