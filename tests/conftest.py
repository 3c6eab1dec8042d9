"""Real meshes for tests that use them, and a one-line summary of skipped tests."""

import gc
import os
import shutil
import signal
import sys
from collections import Counter
from pathlib import Path

import pytest

# A shell or nohup may have made this process ignore signals, which its children would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# Threads of BLAS wait in loops, and so take time from other tests. This process has not loaded it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _find_data() -> Path | None:
    if "SUPERFACETS_DATA" in os.environ:
        return Path(os.environ["SUPERFACETS_DATA"])
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    return beside if beside.is_dir() else None


@pytest.fixture(scope="session")
def real_data() -> Path | None:
    """Return the folder with `meshes` and `psb`, or None if there is none."""
    return _find_data()


@pytest.fixture(scope="session")
def data_dir(real_data: Path | None) -> Path:
    """Return the folder with `meshes` and `psb`; skip the test if there is none."""
    folder = real_data
    if folder is None:
        pytest.skip("no real meshes: set SUPERFACETS_DATA to the folder that has them")
    assert folder.is_dir(), f"SUPERFACETS_DATA is {folder}, which is not a folder"
    return folder


@pytest.fixture(scope="session")
def benchmark_paths(data_dir: Path) -> list[Path]:
    """Return the paths of the benchmark models, the smallest file first.

    There is at least one path, so that tests with loops over models check something.
    """
    folder = data_dir / "psb" / "off"
    paths = sorted(folder.glob("*.off"), key=lambda p: (p.stat().st_size, p.name))
    if not paths:
        pytest.skip(f"no models of the benchmark in {folder}")
    return paths


# Options for software rendering, which works without a graphics card.
_BROWSER_OPTIONS = [
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox",
    "--disable-gpu-compositing",
]  # fmt: skip


@pytest.fixture(scope="module")  # other modules run loops of events of their own
def browser():
    """Start Chromium with Playwright; skip the test if either is missing."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    path = shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("there is no Chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=_BROWSER_OPTIONS)
        yield browser
        browser.close()


SLOW = (
    "studio/browser/", "research/", "batches/", "test_docs.py", "test_benchmark_models.py",
    "test_twins.py", "test_fuzz.py", "test_benchmarks.py", "mesh/test_denoising.py",
    "pictures/test_page_browser.py", "test_invariance.py", "studio/test_studio_server.py",
    "studio/test_studio_crash.py", "pictures/test_plotting.py", "test_types.py",
)  # fmt: skip
"""Files and folders whose tests take two thirds of the time, the slowest first."""


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Hide tests and modules from the garbage collector, which took 0.3 s for them each time."""
    gc.disable()
    result = yield
    gc.freeze()
    gc.enable()
    return result


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests on real meshes and slow tests; slow ones start first, so that none ends last.

    `-m "not real_meshes"` and `-m "not slow"` leave the marked ones out.
    """

    def order(item: pytest.Item) -> int:
        path = item.path.relative_to(Path(__file__).parent).as_posix()
        return next((i for i, part in enumerate(SLOW) if path.startswith(part)), len(SLOW))

    for item in items:
        if "data_dir" in getattr(item, "fixturenames", ()):
            item.add_marker("real_meshes")
        if order(item) < len(SLOW):
            item.add_marker("slow")
    items.sort(key=order)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print one line with the reasons for skipped tests; `pytest -rs` lists these tests."""
    reasons = Counter()
    for report in terminalreporter.getreports("skipped"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        reasons[" ".join(str(reason).removeprefix("Skipped: ").split())] += 1
    if reasons:
        parts = [f"{n} test{'s' * (n > 1)} ({why})" for why, n in reasons.most_common()]
        terminalreporter.write_line(f"not tested: {', '.join(parts)}")


LIMITS = {
    "block of text": ["superfacets.files.readers.text.BLOCK"],
    "cells that are grouped": [
        "superfacets.weights.parts.MIN_GROUPED", "superfacets.clustering.loop.MIN_GROUPED",
    ],
    "faces drawn": ["superfacets_show.notebook.MAX_DRAWN"],
    "points drawn": ["superfacets_show.notebook.MAX_DRAWN_POINTS"],
    "frames of a turn": ["superfacets_show.plotting._N_FRAMES"],
    "bytes of a small scene": ["superfacets.files.guards.ALWAYS_ALLOWED"],
    "growth of a scene": ["superfacets.files.guards.MAX_GROWTH"],
    "bytes of a GLB file": ["superfacets_textures.glb.MAX_BYTES"],
    "wait for a request": ["superfacets_studio.web.server.SECONDS"],
    "rows written at once": [
        f"superfacets.files.writers.{name}.ROWS_AT_ONCE" for name in ("ply", "text_formats")
    ],
    "rows pooled at once": ["superfacets.regions.pooling._ROWS_AT_ONCE"],
    "ids in a GLB file": ["superfacets_textures.glb.MAX_IDS"],
    "pairs of regions in masks": ["superfacets_scans.lifting.MAX_PAIRS"],
    "many regions": ["superfacets.clustering.coarsening.MANY_REGIONS"],
    "faces that show what is up": ["superfacets_show.scene._MAX_SAMPLES"],
    "size of a turn": ["superfacets_show.plotting._MOVING_SIZE"],
    "delay of the bar": ["superfacets_cli.progress.Progress.DELAY"],
    "numbers of objects": ["superfacets_studio.documents.document.MAX_OBJECT"],
    "bytes of a request": ["superfacets_studio.web.messages.MAX_BODY"],
    "time for a thumbnail": ["superfacets_studio.web.thumbnails.SECONDS"],
    "wait for a worker": ["superfacets_batch.cluster.PATIENCE"],
    "memory of a worker process": ["superfacets.tools.sources.BASE"],
    "wait for a scheduler": ["superfacets_batch.cluster.CONNECT_TIMEOUT"],
}  # fmt: skip
"""Limits that tests change, because reaching the real ones would take too long."""


@pytest.fixture
def limit(monkeypatch):
    """Return a function that sets one of `LIMITS` during the test."""

    def set_limit(name, value):
        for target in LIMITS[name]:
            monkeypatch.setattr(target, value)

    return set_limit


@pytest.fixture
def broken(monkeypatch):
    """Return a function that makes a function raise an error, or fail the test if it is called."""

    def break_function(target, error=None):
        def fail(*_, **__):
            raise error or AssertionError(f"{target} must not be called")

        monkeypatch.setattr(target, fail)

    return break_function


@pytest.fixture
def forbid(monkeypatch):
    """Return a function that takes permissions away, because root may read and write everything."""
    return lambda is_allowed=lambda *_: False: monkeypatch.setattr(os, "access", is_allowed)


@pytest.fixture
def temporary(monkeypatch):
    """Return a function that sets the folder of temporary files."""
    return lambda folder: monkeypatch.setattr("tempfile.tempdir", str(folder))


@pytest.fixture
def terminal(monkeypatch):
    """Return a function that makes standard output or standard error a terminal."""
    return lambda stream: monkeypatch.setattr(stream, "isatty", lambda: True)


@pytest.fixture
def run_main(monkeypatch, capsys):
    """Return a function that runs a command, and returns its exit status, stdout and stderr."""

    def run(main, *arguments):
        monkeypatch.setattr(sys, "argv", [*map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code, *capsys.readouterr()

    return run


@pytest.fixture
def sheet(tmp_path):
    """Write a mesh of 1,152 faces, and return its path."""
    import shapes

    from superfacets import write_mesh

    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(24))
    return path
