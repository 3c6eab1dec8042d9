"""A studio that answers, and a browser that looks at it."""

import pytest

from superfacets import sample_mesh, write_mesh

pytest.importorskip("starlette", reason="Starlette is not installed")
pytest.importorskip("uvicorn", reason="uvicorn is not installed")

from studio_page import Command, Server, Tab

SIZE = {"width": 700, "height": 460}


@pytest.fixture
def serve():
    """Starts a studio on a path; all are ended after the test."""
    servers = []

    def start(path, n_segments, kind=Server):
        servers.append(kind(path, n_segments))
        return servers[-1]

    yield start
    for server in servers:
        server.stop()


@pytest.fixture
def open_tab(browser):
    """Opens an address; no script may fail meanwhile."""
    context = browser.new_context(viewport=SIZE, reduced_motion="reduce")
    errors = []

    def open_page(address):
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        return Tab(page).ready()

    yield open_page
    context.close()
    assert errors == []


@pytest.fixture
def bear(tmp_path):
    """A file with a small bear."""
    write_mesh(tmp_path / "bear.ply", sample_mesh(5_000))
    return tmp_path / "bear.ply"


@pytest.fixture
def studio(serve, open_tab, bear):
    """A server and the page that it shows."""
    server = serve(bear, 40)
    return server, open_tab(server.address)


@pytest.fixture
def command(serve, open_tab, bear):
    """The same with a server that can be killed."""
    server = serve(bear, 40, Command)
    return server, open_tab(server.address)
