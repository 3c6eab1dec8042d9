"""Run the web server, and close connections whose clients make no progress."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from ..documents.files import Files
from .address import Address, address_file, keep
from .app import Studio, studio_app

MAX_CONNECTIONS = 64
"""Maximum number of connections. A browser opens at most six. Some systems allow only 256 open
files, and each connection is one."""

BACKLOG = 32  # maximum number of connections that are not yet accepted
SECONDS = 10.0  # time in seconds after which a connection without progress is closed


def serve(
    files: Files, opened: socket.socket, address: Address, on_start: Callable[[str], object]
) -> None:
    """Run the server until Ctrl-C or a quit request; `on_start` gets the URL of the page."""
    studio = Studio(files, lambda: setattr(server, "should_exit", True))
    config = uvicorn.Config(
        studio_app(studio, address.token, address.port), log_level="error", access_log=False,
        http=Connection, lifespan="off", ws="none", server_header=False, proxy_headers=False,
        backlog=BACKLOG, timeout_graceful_shutdown=2,
    )  # fmt: skip
    server = _Server(config)
    server.on_start = lambda: on_start(address.page)
    server.on_end = studio.thumbnails.close
    try:
        with keep(address_file(files.home), address), contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[opened])
    finally:
        files.close()


class _Server(uvicorn.Server):
    on_start: Callable[[], object]
    on_end: Callable[[], object]

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        self.on_start()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self.on_end()  # called before the server waits for running requests
        await super().shutdown(sockets=sockets)


class Connection(H11Protocol):
    """A connection that is closed if its client makes no progress.

    A client must send the complete headers of a request within `SECONDS`. While a body or a reply
    is transferred, at least one byte must be transferred within this time. If there are too many
    connections, the connection that has waited longest for a request is closed.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the timer of a new connection; if there are too many, close one that is idle."""
        super().connection_made(transport)
        self._n_received = 0
        self._watch()
        if len(self.connections) > MAX_CONNECTIONS:
            open_ones = [other for other in self.connections if isinstance(other, Connection)]
            idle = [other for other in open_ones if other._is_idle]  # includes this connection
            min(idle, key=lambda other: other._timer.when())._give_up()

    def data_received(self, data: bytes) -> None:
        """Count received bytes of a request, and process them."""
        self._n_received += len(data)
        super().data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timer of a closed connection."""
        self._timer.cancel()
        super().connection_lost(exc)

    @property
    def _is_idle(self) -> bool:
        """Whether the connection waits for the headers of a request."""
        return self.cycle is None or self.cycle.response_complete

    def _awaited(self) -> tuple[object, ...] | None:
        """Return a value that changes with the client's progress, or None if the server is busy."""
        n_unsent = self.transport.get_write_buffer_size()
        if n_unsent:
            return "reply", self.cycle, n_unsent
        if self._is_idle:
            return "headers", self.cycle
        return ("body", self._n_received) if self.cycle.more_body else None

    def _watch(self) -> None:
        self._timer = self.loop.call_later(SECONDS, self._check, self._awaited())

    def _check(self, before: tuple[object, ...] | None) -> None:
        """Close the connection if `_awaited` has not changed since the last check."""
        if before is not None and self._awaited() == before:
            self._give_up()
        else:
            self._watch()

    def _give_up(self) -> None:
        self._timer.cancel()
        self.connections.discard(self)  # now, because the event loop calls `connection_lost` later
        self.transport.abort()
