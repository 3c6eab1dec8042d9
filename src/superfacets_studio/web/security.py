"""Reject requests that come from pages of other sites, or that lack the token."""

from __future__ import annotations

import hmac
from dataclasses import dataclass

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .address import HOST

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline';"
        " frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
    "Cache-Control": "no-store", "X-Frame-Options": "DENY", "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # because the URL of the page contains the token
}  # fmt: skip

MAX_PATH = 200
"""Maximum length of a URL path. All routes are shorter. Longer paths could contain numbers with so
many digits that Python refuses to convert them."""

OPEN_PREFIX = "/static/"  # URL prefix of scripts and styles, which are sent without a token


@dataclass
class Guard:
    """ASGI middleware that rejects requests from pages of other sites or without the token."""

    app: ASGIApp
    token: str
    port: int

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Forward a request to the application, or reject it; all replies get `HEADERS`."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # websockets are not supported
            return
        reason = self._reason_against(scope)
        app = self.app if reason is None else _refusal(scope["path"], *reason)
        await app(scope, receive, _with_headers(send))

    def _reason_against(self, scope: Scope) -> tuple[int, str] | None:
        """Return the status and message of the rejection, or None if the request is accepted."""
        headers, path = Headers(scope=scope), scope["path"]
        if headers.get("host") not in self._hosts:
            return 403, "the studio can be opened only at the address that it has printed"
        is_page = path == "/" and scope["method"] == "GET"  # a local file redirects to the page
        if not is_page and not self._is_same_page(headers):
            return 403, "the request comes from a page of another site"
        if len(path) > MAX_PATH:
            return 414, "the path is too long"
        if not path.startswith(OPEN_PREFIX) and not self._has_token(scope, headers):
            return 403, "the token is missing or wrong: open the address that was printed"
        return None

    def _is_same_page(self, headers: Headers) -> bool:
        """Return whether a request comes from a page of this server or from no page (a script)."""
        origins = (None, *(f"http://{host}" for host in self._hosts))
        sites = (None, "none", "same-origin")
        return headers.get("origin") in origins and headers.get("sec-fetch-site") in sites

    def _has_token(self, scope: Scope, headers: Headers) -> bool:
        given = headers.get("x-token") or Request(scope).query_params.get("token") or ""
        return hmac.compare_digest(given.encode(), self.token.encode())

    @property
    def _hosts(self) -> tuple[str, ...]:
        return f"{HOST}:{self.port}", f"localhost:{self.port}"


def _refusal(path: str, status: int, message: str) -> Response:
    if path.startswith("/api/"):
        return JSONResponse({"error": message}, status)
    return PlainTextResponse(f"superfacets studio: {message}\n", status)


def _with_headers(send: Send) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(HEADERS)
        await send(message)

    return send_with_headers
