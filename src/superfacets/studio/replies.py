"""What requests hold, and what is answered when something is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from ..errors import MeshError, MissingExtraError, RenderError
from .document import NothingError
from .journal import JournalError, WriteError
from .revisions import GoneError
from .source import ChangedError

__all__ = ["Body", "JsonReply", "answered", "body_of", "failure", "message_of"]

Body = dict[str, Any]


class JsonReply(JSONResponse):
    """JSON in ASCII, so that any name of a file can be told, also one that is no valid text."""

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
    (ValueError, 400),
    (TypeError, 400),
    (IndexError, 404),
    (OSError, 500),
    (MemoryError, 507),
)
"""What the status of an answer says of an error: the first that fits."""


async def answered(work: Callable[[], Any]) -> Response:
    """What comes out of work in a thread; errors as one line."""
    try:
        result = await run_in_threadpool(work)
    except Exception as error:
        return failure(error)
    return result if isinstance(result, Response) else JsonReply(result)


async def body_of(request: Request) -> Body:
    """The JSON object of a request; a ValueError if it is none."""
    data = await request.body()
    try:
        body = json.loads(data or b"{}")
    except ValueError:
        raise ValueError("the request is not JSON") from None
    if not isinstance(body, dict):
        raise ValueError("the request is no JSON object")
    return body


def failure(error: Exception) -> Response:
    """An error as an answer; raised again where it is a fault of ours."""
    for kind, status in STATUS_OF:
        if isinstance(error, kind):
            return JsonReply({"error": message_of(error)}, status)
    raise error


def message_of(error: Exception) -> str:
    """One line; the system's errors name the file without its folder."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError) and error.strerror is not None:
        return f"{error.filename or 'the machine'}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__
