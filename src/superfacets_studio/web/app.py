"""Define the HTTP routes of the server, and stream the progress of a segmentation."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from contextlib import nullcontext
from dataclasses import dataclass, field
from importlib.resources import files

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp

from ..documents.files import Files
from ..regions.revisions import Partition
from ..regions.segmenting import Cancelled, SegmentationTask, checked_parameters
from .messages import STATUS_OF, Body, JsonReply, answered, body_of, failure, message_of
from .operations import OPERATIONS, READS, Operation, border_packet, progress_of, regions_of
from .security import Guard
from .thumbnails import Thumbnails

_FILE = "/api/files/{id:int}"


@dataclass
class Studio:
    """Open files of the server, and the HTTP endpoints that use them."""

    files: Files
    quit: Callable[[], object]  # function that stops the server
    thumbnails: Thumbnails = field(default_factory=Thumbnails)

    async def list_files(self, request: Request) -> Response:
        """Reply with the list of all files and their progress."""
        return await answered(self.files.listed)

    async def quit_server(self, request: Request) -> Response:
        """Stop the server."""
        self.quit()
        return JsonReply({"quits": True})

    async def thumbnail(self, request: Request) -> Response:
        """Reply with a small picture of a file, as PNG."""

        def drawn() -> Response:
            path = self.files.path(request.path_params["id"])
            return Response(self.thumbnails.png(path, self.files.up), media_type="image/png")

        return await answered(drawn)

    async def segment(self, request: Request) -> Response:
        """Segment a file and stream the progress; reply with an error if a parameter is invalid."""
        number = request.path_params["id"]

        def checked(body: Body) -> Body:
            with self.files.document(number) as document:
                now = document.state.partition.parameters
                return checked_parameters(body, now, document.n_cells)

        body = await body_of(request)
        is_preview = bool(body.pop("preview", False))
        parameters = await run_in_threadpool(checked, body)
        lines = _progress_lines(self.files, number, parameters, is_preview=is_preview)
        return StreamingResponse(lines, media_type="application/x-ndjson")

    def route(self, name: str, work: Operation, method: str, *, locks: bool = True) -> Route:
        """Return the route of an operation, which gets the query (GET) or the JSON body (POST)."""

        async def endpoint(request: Request) -> Response:
            is_read = method == "GET"
            given = dict(request.query_params) if is_read else await body_of(request)

            def done() -> object:
                number = request.path_params["id"]
                with (
                    self.files.document(number) as document,
                    document.lock if locks else nullcontext(),
                ):
                    found = work(document, given)
                    return found if is_read else {**(found or {}), **progress_of(document)}

            return await answered(done)

        return Route(f"{_FILE}/{name}", endpoint, methods=[method])


def studio_app(studio: Studio, token: str, port: int) -> ASGIApp:
    """Return the ASGI application: all routes, protected by the access control of `Guard`."""
    static = files("superfacets_studio").joinpath("static")
    routes: list[BaseRoute] = [
        Route("/", lambda _: FileResponse(str(static / "index.html"))),
        Route("/api/files", studio.list_files),
        Route("/api/quit", studio.quit_server, methods=["POST"]),
        Route(f"{_FILE}/thumbnail", studio.thumbnail),
        Route(f"{_FILE}/segment", studio.segment, methods=["POST"]),
        *(studio.route(name, read, "GET") for name, read in READS.items()),
        *(studio.route(name, do, "POST") for name, do in OPERATIONS.items()),
        studio.route("borders", border_packet, "GET", locks=False),  # strokes do not wait for it
        Mount("/static", StaticFiles(directory=str(static))),
    ]  # fmt: skip
    handlers = dict.fromkeys((404, 405), _not_found) | dict.fromkeys(STATUS_OF, failure)
    return Guard(Starlette(routes=routes, exception_handlers=handlers), token, port)


async def _not_found(request: Request, error: Exception) -> Response:
    message = f"unknown route: {request.method} {request.url.path}"
    return JsonReply({"error": message}, getattr(error, "status_code", 404))


async def _progress_lines(
    files: Files, number: int, parameters: Body, *, is_preview: bool
) -> AsyncIterator[str]:
    """Segment a file; yield lines of JSON with the progress, and finally a line with the result."""
    loop = asyncio.get_running_loop()
    queue: asyncio.Queue[Body | None] = asyncio.Queue()
    task = SegmentationTask(lambda fact: loop.call_soon_threadsafe(queue.put_nowait, fact))
    work = asyncio.ensure_future(
        run_in_threadpool(_segment_file, files, number, parameters, task, is_preview)
    )
    work.add_done_callback(lambda _: queue.put_nowait(None))
    try:
        while (fact := await queue.get()) is not None:
            yield _line(fact)
        yield _line(await work)
    finally:  # runs also if the client disconnects
        task.cancel()


def _segment_file(
    files: Files, number: int, parameters: Body, task: SegmentationTask, is_preview: bool
) -> Body:
    try:
        with files.document(number) as document:
            start = time.perf_counter()
            base = document.segmenter.run(parameters, task)
            task.check()
            if is_preview:
                partition = Partition(parameters, base.digest)
                revision = document.revisions.add(partition, base.labels, base.n_regions)
            else:
                revision = document.set_base(parameters, base)
            progress = progress_of(document)
    except Cancelled:
        return {"cancelled": True}
    except Exception as error:
        return {"error": message_of(error)}
    seconds = round(time.perf_counter() - start, 3)
    found = {**regions_of(revision), "seconds": seconds, "parameters": parameters}
    return {**found, "notes": list(base.notes), **progress}


def _line(fact: Body) -> str:
    return json.dumps(fact, separators=(",", ":")) + "\n"
