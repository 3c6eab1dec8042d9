"""Fixtures of the tests of the studio."""

import pytest


@pytest.fixture
def document(sheet):
    """Return a document of that mesh with 20 regions."""
    from superfacets_studio.documents.document import Document

    opened = Document.open(sheet, n_segments=20)
    yield opened
    opened.close()


@pytest.fixture
def serve():
    """Return a function that makes a client for a path; keywords are those of `Files.of`."""
    pytest.importorskip("httpx")
    from studio_client import client_of

    opened = []

    def _serve(path, **options):
        opened.append(client_of(path, **options))
        return opened[-1]

    yield _serve
    for client in opened:
        client.close()


@pytest.fixture
def client(serve, sheet):
    """Return a client of a studio for the sheet, with 20 regions."""
    return serve(sheet, n_segments=20)
