"""The routes of the server."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from importlib.resources import files

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from ..errors import RenderError
from .folder import Files
from .operations import OPERATIONS, READS, Operation
from .parameters import checked_parameters
from .replies import Body, JsonReply, answered, body_of, failure, message_of
from .runs import told
from .security import Guard
from .thumbnails import Thumbnails

NO_BUNDLE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>superfacets studio</title>
<p>The server runs, but this installation has no front end: <code>static/index.html</code> is
missing. Wheels have it; in a checkout, <code>make frontend</code> builds it.</p></html>
"""

_LINES = "application/x-ndjson"

Endpoint = Callable[[Request], Awaitable[Response]]


@dataclass
class Studio:
    """The server's state.

    Attributes
    ----------
    files : Files
    quit : callable
        Ends the server.
    thumbnails : Thumbnails
    """

    files: Files
    quit: Callable[[], object]
    thumbnails: Thumbnails = field(default_factory=Thumbnails)


def studio_app(studio: Studio, token: str, port: int) -> ASGIApp:
    """The server's application: all routes, behind the guard."""
    static = files(__package__).joinpath("static")
    routes: list[BaseRoute] = [
        Route("/", _page),
        Route("/api/files", _listing(studio)),
        Route("/api/quit", _quit(studio), methods=["POST"]),
    ]
    if static.is_dir():
        routes.append(Mount("/static", StaticFiles(directory=str(static))))
    one = "/api/files/{id:int}"
    routes += [_reading(studio, f"{one}/{name}", read) for name, read in READS.items()]
    routes += [_writing(studio, f"{one}/{name}", do) for name, do in OPERATIONS.items()]
    routes.append(Route(f"{one}/thumbnail", _thumbnail(studio)))
    routes.append(Route(f"{one}/segment", _segmenting(studio), methods=["POST"]))
    app = Starlette(routes=routes, exception_handlers={404: _not_found, 405: _not_found})
    return Guard(app, token, port)


async def _page(request: Request) -> Response:
    index = files(__package__).joinpath("static", "index.html")
    return HTMLResponse(index.read_text(encoding="utf-8") if index.is_file() else NO_BUNDLE)


async def _not_found(request: Request, error: Exception) -> Response:
    message = f"there is no {request.method} {request.url.path}"
    return JsonReply({"error": message}, getattr(error, "status_code", 404))


def _listing(studio: Studio) -> Endpoint:
    async def list_files(request: Request) -> Response:
        return await answered(studio.files.listed)

    return list_files


def _thumbnail(studio: Studio) -> Endpoint:
    async def thumbnail(request: Request) -> Response:
        def drawn() -> Response:
            path = studio.files.path(request.path_params["id"])
            try:
                return Response(studio.thumbnails.png(path), media_type="image/png")
            except RenderError as error:
                return JsonReply({"error": message_of(error)}, 404)

        return await answered(drawn)

    return thumbnail


def _quit(studio: Studio) -> Endpoint:
    async def quit_server(request: Request) -> Response:
        studio.quit()
        return JsonReply({"quits": True})

    return quit_server


def _segmenting(studio: Studio) -> Endpoint:
    async def segment(request: Request) -> Response:
        number = request.path_params["id"]

        def checked(body: Body) -> Body:
            with studio.files.document(number) as document:
                now = document.state.partition.parameters
                return checked_parameters(body, now, document.n_cells)

        try:
            body = await body_of(request)
            is_preview = bool(body.pop("preview", False))
            parameters = await run_in_threadpool(checked, body)
        except Exception as error:
            return failure(error)
        lines = told(studio.files, number, parameters, is_preview=is_preview)
        return StreamingResponse(lines, media_type=_LINES)

    return segment


def _reading(studio: Studio, path: str, read: Operation) -> Route:
    async def endpoint(request: Request) -> Response:
        query = dict(request.query_params)
        return await _with_document(studio, request, read, query)

    return Route(path, endpoint, methods=["GET"])


def _writing(studio: Studio, path: str, do: Operation) -> Route:
    async def endpoint(request: Request) -> Response:
        try:
            body = await body_of(request)
        except Exception as error:
            return failure(error)
        return await _with_document(studio, request, do, body)

    return Route(path, endpoint, methods=["POST"])


async def _with_document(
    studio: Studio, request: Request, work: Operation, given: Body
) -> Response:
    def done() -> object:
        with studio.files.document(request.path_params["id"]) as document:
            return work(document, given)

    return await answered(done)
