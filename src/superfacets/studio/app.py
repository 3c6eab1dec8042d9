"""The routes of the server."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any
from urllib.parse import quote

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from ..errors import MeshError, MissingExtraError, RenderError
from .answers import counts_of, moved, regions_packet, state_of
from .changes import Partition
from .coding import base64_of, bytes_from, cells_from
from .document import ChangedError, Document, NothingError
from .exports import export, export_bytes
from .folder import Files
from .imports import read_import
from .journal import JournalError
from .parameters import checked_parameters
from .revisions import GoneError
from .security import Guard
from .segmenting import Cancelled, Turn
from .shapes import mesh_packet
from .similar import similar_regions
from .thumbnails import Thumbnails

__all__ = ["Studio", "studio_app"]

STATUS_OF = (
    (NothingError, 409),
    (GoneError, 410),
    (ChangedError, 409),
    (JournalError, 507),
    (FileExistsError, 409),
    (MissingExtraError, 501),
    (RenderError, 501),
    (MeshError, 422),
    (ValueError, 400),
    (TypeError, 400),
    (IndexError, 404),
    (OSError, 500),
    (MemoryError, 507),
)
"""What the status of an answer says of an error: the first that fits."""

NO_BUNDLE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>superfacets studio</title>
<p>The server runs, but this installation has no front end: <code>static/index.html</code> is
missing. Wheels have it; in a checkout, <code>make frontend</code> builds it.</p></html>
"""

_OCTETS = "application/octet-stream"
_LINES = "application/x-ndjson"

Body = dict[str, Any]
Endpoint = Callable[[Request], Awaitable[Response]]
Operation = Callable[["Document", Body], Any]


@dataclass
class Studio:
    """The server's state.

    Attributes
    ----------
    files : Files
    quit : callable
        Ends the server.
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
    return JSONResponse({"error": message}, getattr(error, "status_code", 404))


def _listing(studio: Studio) -> Endpoint:
    async def list_files(request: Request) -> Response:
        return await _answered(studio.files.listed)

    return list_files


def _thumbnail(studio: Studio) -> Endpoint:
    async def thumbnail(request: Request) -> Response:
        def drawn() -> Response:
            path = studio.files.path(request.path_params["id"])
            try:
                return Response(studio.thumbnails.png(path), media_type="image/png")
            except RenderError as error:
                return JSONResponse({"error": _message(error)}, 404)

        return await _answered(drawn)

    return thumbnail


def _quit(studio: Studio) -> Endpoint:
    async def quit_server(request: Request) -> Response:
        studio.quit()
        return JSONResponse({"quits": True})

    return quit_server


# Reading.


def _read_classes(document: Document, query: Body) -> Response:
    with document.lock:
        return Response(document.state.classes.astype("<u2").tobytes(), media_type=_OCTETS)


def _read_labels(document: Document, query: Body) -> Response:
    revision = document.revisions.get(_number(query))
    return Response(revision.labels.astype("<i4").tobytes(), media_type=_OCTETS)


def _read_mesh(document: Document, query: Body) -> Response:
    return Response(mesh_packet(document), media_type=_OCTETS)


def _read_regions(document: Document, query: Body) -> Response:
    revision = document.revisions.get(_number(query))
    return Response(regions_packet(document, revision), media_type=_OCTETS)


def _read_export(document: Document, query: Body) -> Response:
    what, format = str(query.get("what", "cells")), str(query.get("format"))
    name, content = export_bytes(document, what, format)
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"}
    return Response(content, media_type=_OCTETS, headers=headers)


READS: dict[str, Operation] = {
    "classes": _read_classes,
    "export": _read_export,
    "labels": _read_labels,
    "mesh": _read_mesh,
    "regions": _read_regions,
    "state": lambda document, query: state_of(document),
}


# Operations.


def _paint(document: Document, body: Body) -> Body:
    number = body.get("class")
    if isinstance(number, bool) or not isinstance(number, int):
        raise ValueError("class must be the number of a class, or 0")
    stroke = body.get("stroke")
    if stroke is not None and not (isinstance(stroke, str) and len(stroke) <= 64):
        raise ValueError("stroke must be a text of up to 64 characters")
    if "regions" in body:
        cells = document.revisions.get(body.get("revision")).cells_of_all(
            _numbers(body["regions"], "regions")
        )
    else:
        cells = cells_from(body.get("cells"), document.n_cells)
    with document.lock:
        change = document.paint(cells, number, stroke)
        return {"changed": 0 if change is None else change.after.n, **counts_of(document)}


def _undo(document: Document, body: Body) -> Body:
    with document.lock:
        return moved(document, document.undo())


def _redo(document: Document, body: Body) -> Body:
    with document.lock:
        return moved(document, document.redo())


def _similar(document: Document, body: Body) -> Body:
    revision = document.revisions.get(body.get("revision"))
    graph = revision.graph(document.segmenter.surface)
    region = _whole(body.get("region"), "region")
    return {"regions": similar_regions(graph, region, body.get("tolerance", 0.1))}


def _set_classes(document: Document, body: Body) -> Body:
    with document.lock:
        document.set_classes(body.get("classes"))
        return {"classes": list(document.class_list), **counts_of(document)}


def _split(document: Document, body: Body) -> Body:
    strokes = []
    for name in ("red", "blue"):
        stroke = _numbers(body.get(name), name)
        given = np.unique(np.asarray(stroke, np.int64))
        if len(given) and not 0 <= given[0] <= given[-1] < document.n_cells:
            raise ValueError(f"{name} holds a cell that is none of {document.n_cells}")
        strokes.append(given.astype(np.uint32))
    region = _whole(body.get("region"), "region")
    with document.lock:
        cells = document.split(region, body.get("revision"), *strokes)
        revision = document.revision
        found = {"revision": revision.number, "n_regions": revision.n_regions}
        return {**found, "cells": base64_of(cells), **counts_of(document)}


def _export(document: Document, body: Body) -> Body:
    what, format = str(body.get("what", "cells")), str(body.get("format"))
    path = export(document, what, format, replace=body.get("replace") is True)
    return {"path": str(path), "name": path.name}


def _import(document: Document, body: Body) -> Body:
    given = body.get("files")
    if not isinstance(given, list) or not all(isinstance(file, dict) for file in given):
        raise ValueError("files must be a list of objects with a name and data")
    files = {str(file.get("name")): bytes_from(file.get("data")) for file in given}
    imported = read_import(files, document.cells, document.class_list)
    with document.lock:
        change = document.take(imported)
        changed = 0 if change is None else change.after.n
        return {"changed": changed, "classes": list(document.class_list), **counts_of(document)}


OPERATIONS: dict[str, Operation] = {
    "paint": _paint,
    "undo": _undo,
    "redo": _redo,
    "similar": _similar,
    "classes": _set_classes,
    "split": _split,
    "export": _export,
    "import": _import,
}


def _numbers(value: object, name: str) -> list[int]:
    if not isinstance(value, list):
        raise ValueError(f"{name} must be a list of numbers")
    return [_whole(number, f"each of {name}") for number in value]


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{name} must be a whole number")
    return value


def _number(query: Body) -> int:
    text = str(query.get("revision", ""))
    if not text.isdecimal():
        raise ValueError("revision must be a number, as the state has it")
    return int(text)


# Segmenting.


def _segmenting(studio: Studio) -> Endpoint:
    async def segment(request: Request) -> Response:
        try:
            body = await _body_of(request)
            document = await run_in_threadpool(studio.files.document, request.path_params["id"])
            is_preview = bool(body.pop("preview", False))
            parameters = checked_parameters(
                body, document.state.partition.parameters, document.n_cells
            )
        except Exception as error:
            return _failure(error)
        lines = _told(document, parameters, is_preview=is_preview)
        return StreamingResponse(lines, media_type=_LINES)

    return segment


async def _told(document: Document, parameters: Body, *, is_preview: bool) -> AsyncIterator[str]:
    """Lines of progress, and a last one with the revision."""
    loop = asyncio.get_running_loop()
    queue: asyncio.Queue[Body | None] = asyncio.Queue()
    turn = Turn(lambda fact: loop.call_soon_threadsafe(queue.put_nowait, fact))
    work = asyncio.ensure_future(
        run_in_threadpool(_segmented, document, parameters, turn, is_preview)
    )
    work.add_done_callback(lambda _: queue.put_nowait(None))
    try:
        while (fact := await queue.get()) is not None:
            yield _line(fact)
        yield _line(await work)
    finally:  # also where the client has gone
        turn.cancel()


def _segmented(document: Document, parameters: Body, turn: Turn, is_preview: bool) -> Body:
    start = time.perf_counter()
    try:
        base = document.segmenter.run(parameters, turn)
        turn.check()
        if is_preview:
            partition = Partition(parameters, base.digest)
            revision = document.revisions.add(partition, base.labels, base.n_regions)
        else:
            revision = document.set_base(parameters, base)
    except Cancelled:
        return {"cancelled": True}
    except Exception as error:
        return {"error": _message(error)}
    seconds = round(time.perf_counter() - start, 3)
    found = {"revision": revision.number, "n_regions": revision.n_regions, "seconds": seconds}
    return {**found, "parameters": parameters, "notes": list(base.notes), **counts_of(document)}


def _line(fact: Body) -> str:
    return json.dumps(fact, separators=(",", ":")) + "\n"


# Requests and answers.


def _reading(studio: Studio, path: str, read: Operation) -> Route:
    async def endpoint(request: Request) -> Response:
        query = dict(request.query_params)
        return await _with_document(studio, request, read, query)

    return Route(path, endpoint, methods=["GET"])


def _writing(studio: Studio, path: str, do: Operation) -> Route:
    async def endpoint(request: Request) -> Response:
        try:
            body = await _body_of(request)
        except ValueError as error:
            return _failure(error)
        return await _with_document(studio, request, do, body)

    return Route(path, endpoint, methods=["POST"])


async def _with_document(
    studio: Studio, request: Request, work: Operation, given: Body
) -> Response:
    number = request.path_params["id"]
    return await _answered(lambda: work(studio.files.document(number), given))


async def _answered(work: Callable[[], Any]) -> Response:
    """What comes out of work in a thread; errors as one line."""
    try:
        result = await run_in_threadpool(work)
    except Exception as error:
        return _failure(error)
    return result if isinstance(result, Response) else JSONResponse(result)


async def _body_of(request: Request) -> Body:
    """The JSON object of a request; a ValueError if it is none."""
    data = await request.body()
    try:
        body = json.loads(data or b"{}")
    except ValueError:
        raise ValueError("the request is not JSON") from None
    if not isinstance(body, dict):
        raise ValueError("the request is no JSON object")
    return body


def _failure(error: Exception) -> Response:
    for kind, status in STATUS_OF:
        if isinstance(error, kind):
            return JSONResponse({"error": _message(error)}, status)
    raise error


def _message(error: Exception) -> str:
    """One line; the system's errors name the file without its folder."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'the machine'}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__
