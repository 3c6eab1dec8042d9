"""Fixtures: a running studio, and a browser that shows its page."""

import pytest

from superfacets import sample_mesh, write_mesh

pytest.importorskip("starlette", reason="Starlette is not installed")
pytest.importorskip("uvicorn", reason="uvicorn is not installed")

from studio_page import VIEW, WAIT_MS, Command, Server, Tab


@pytest.fixture(scope="module")
def context(browser):
    """Return the browser context that all pages of a module share."""
    opened = browser.new_context(**VIEW, reduced_motion="reduce")
    opened.set_default_timeout(WAIT_MS)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def shared(context, tmp_path_factory):
    """Return a server and page that tests share, since opening a page is slow."""
    path = tmp_path_factory.mktemp("shared") / "bear.ply"
    write_mesh(path, sample_mesh(3_000))
    server = Server(path, 40)
    page = context.new_page()
    yield server, Tab(page)
    page.close()
    server.stop()


@pytest.fixture
def errors(context):
    """Collect errors of scripts, and fail the test if there are any."""
    found = []

    def note(error):
        found.append(str(error))

    context.on("weberror", note)
    yield found
    context.remove_listener("weberror", note)
    assert found == []


@pytest.fixture
def studio(shared, errors):
    """Return the shared server and page, reset as if both had just been started."""
    server, tab = shared
    if tab.page.url == "about:blank":
        tab.page.goto(server.address)
    tab.page.bring_to_front()  # others are slow
    tab.ready().begin_anew()
    return server, tab


@pytest.fixture
def serve():
    """Return a function that starts a studio on a path; all studios end after the test."""
    servers = []

    def start(path, n_segments, kind=Server):
        servers.append(kind(path, n_segments))
        return servers[-1]

    yield start
    for server in servers:
        server.stop()


@pytest.fixture(scope="module")
def blank_pages():
    """Return a list of open pages that show nothing, because a new one takes twice as long."""
    return []


@pytest.fixture
def open_tab(context, errors, blank_pages):
    """Return a function that opens an address in a tab with the size of a new one."""
    pages = []

    def open_page(address):
        pages.append(blank_pages.pop() if blank_pages else context.new_page())
        pages[-1].bring_to_front()
        pages[-1].set_viewport_size(VIEW["viewport"])
        pages[-1].goto(address)
        return Tab(pages[-1]).ready()

    yield open_page
    for page in pages:
        if not page.is_closed():
            page.goto("about:blank")
            blank_pages.append(page)


@pytest.fixture
def bear(tmp_path):
    """Return a file with a small bear."""
    write_mesh(tmp_path / "bear.ply", sample_mesh(3_000))
    return tmp_path / "bear.ply"


@pytest.fixture
def command(serve, open_tab, bear):
    """Return a server process that can be killed, and its page."""
    server = serve(bear, 40, Command)
    return server, open_tab(server.address)
