"""Bodies of requests, and answers, including errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response

from ..errors import MeshError, MissingExtraError, RenderError
from ..io.attributes import is_encodable
from .history import NothingError
from .journal import JournalError, WriteError
from .revisions import GoneError
from .source import ChangedError

Body = dict[str, Any]

BYTES = "application/octet-stream"

MAX_BODY = 1 << 29  # maximum bytes of a request; strings of browsers are not longer


class TooLargeError(ValueError):
    """The body of a request is too large."""


class JsonReply(JSONResponse):
    """JSON in ASCII, which can contain every file name, including invalid Unicode."""

    def render(self, content: Any) -> bytes:
        """The bytes of an answer."""
        return json.dumps(content, separators=(",", ":")).encode("ascii")


STATUS_OF = (
    (NothingError, 409),
    (GoneError, 410),
    (ChangedError, 409),
    (WriteError, 507),
    (JournalError, 409),
    (FileExistsError, 409),
    (MissingExtraError, 501),
    (RenderError, 501),
    (MeshError, 422),
    (TooLargeError, 413),
    (ValueError, 400),
    (TypeError, 400),
    (IndexError, 404),
    (OSError, 500),
    (MemoryError, 507),
    (ClientDisconnect, 400),  # nobody receives it
)
"""Status of the answer to an error: that of the first class in the list that it belongs to."""


async def answered(work: Callable[[], Any]) -> Response:
    """The answer with the result of work in a thread (an answer, bytes or JSON), or its error."""
    try:
        result = await run_in_threadpool(work)
    except Exception as error:
        return failure(error)
    if isinstance(result, bytes):
        return Response(result, media_type=BYTES)
    return result if isinstance(result, Response) else JsonReply(result)


async def body_of(request: Request) -> Body:
    """The JSON object of a request.

    Raises TooLargeError if it has more than `MAX_BODY` bytes; ValueError if it is no JSON object,
    or contains text that is not valid Unicode.
    """
    text = await _content(request)
    try:
        body = json.loads(text.decode("utf-8") or "{}", parse_constant=_no_constant)
        is_text = b"\\u" not in text or is_encodable(json.dumps(body, ensure_ascii=False))
    except RecursionError:
        raise ValueError("the request is nested too deeply") from None
    except ValueError:
        raise ValueError("the request is not JSON") from None
    if not is_text:
        raise ValueError("the request has half of a surrogate pair in a text")
    if not isinstance(body, dict):
        raise ValueError("the request is no JSON object")
    return body


async def _content(request: Request) -> bytearray:
    """The body of a request. Its declared length is checked before it is read."""
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


def _no_constant(name: str) -> None:
    raise ValueError(f"{name} is not JSON")


def failure(error: Exception) -> Response:
    """The answer to an error; an error of no listed class is raised again."""
    for kind, status in STATUS_OF:
        if isinstance(error, kind):
            return JsonReply({"error": message_of(error)}, status)
    raise error


def message_of(error: Exception) -> str:
    """The message of an error in one line; errors of the system name their file."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'the machine'}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__
