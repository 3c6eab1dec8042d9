"""Parse requests, and create replies with results or errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response

from superfacets import RenderError
from superfacets.kit import parsed_json

from ..documents.history import NothingError
from ..documents.journal import JournalError, WriteError
from ..documents.source import ChangedError
from ..labels.classes import is_unicode
from ..regions.revisions import GoneError

Body = dict[str, Any]

BYTES = "application/octet-stream"

MAX_BODY = 1 << 29  # maximum size of a request in bytes; browsers cannot make longer strings


class TooLargeError(ValueError):
    """Error raised if the body of a request is too large."""


class JsonReply(JSONResponse):
    """JSON reply in ASCII, which can contain any file name, including invalid Unicode."""

    def render(self, content: Any) -> bytes:
        """Encode the content as JSON."""
        return json.dumps(content, separators=(",", ":")).encode("ascii")


STATUS_OF = {
    NothingError: 409, GoneError: 410, ChangedError: 409, JournalError: 409, FileExistsError: 409,
    WriteError: 507, MemoryError: 507, ImportError: 501, RenderError: 501, OSError: 500,
    TooLargeError: 413, ValueError: 400, TypeError: 400, IndexError: 404,
    ClientDisconnect: 400,  # status is arbitrary: nobody receives it
}  # fmt: skip
"""HTTP status of each class of errors. The status of the nearest base class is used."""


async def answered(work: Callable[[], Any]) -> Response:
    """Call `work` in a thread, and reply with its result: a response, bytes or JSON."""
    result = await run_in_threadpool(work)
    if isinstance(result, bytes):
        return Response(result, media_type=BYTES)
    return result if isinstance(result, Response) else JsonReply(result)


async def body_of(request: Request) -> Body:
    """Read the JSON object in the body of a request.

    Raises TooLargeError if the body has more than `MAX_BODY` bytes, and ValueError if it is not a
    JSON object or contains text that is not valid Unicode.
    """
    text = await _content(request)
    body = parsed_json(text or b"{}", "the request")
    if b"\\u" in text and not is_unicode(json.dumps(body, ensure_ascii=False)):
        raise ValueError("the request contains text that is not valid Unicode: lone surrogate")
    if not isinstance(body, dict):
        raise ValueError("the request is not a JSON object")
    return body


async def _content(request: Request) -> bytearray:
    """Read a body; raise a TooLargeError if it, or the size in the header, exceeds `MAX_BODY`."""
    data = bytearray()
    announced = request.headers.get("content-length", "0")
    if not announced.isdecimal() or int(announced) <= MAX_BODY:
        async for part in request.stream():
            data += part
            if len(data) > MAX_BODY:
                break
        else:
            return data
    raise TooLargeError(f"the request is larger than {MAX_BODY} bytes")


async def failure(request: Request, error: Exception) -> Response:
    """Return the reply for an error of a class in `STATUS_OF`."""
    status = next(STATUS_OF[kind] for kind in type(error).__mro__ if kind in STATUS_OF)
    return JsonReply({"error": message_of(error)}, status)


def message_of(error: Exception) -> str:
    """Return the message of an error in one line; messages of system errors name the file."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'system error'}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__
