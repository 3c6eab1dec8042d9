"""The server: a port of this machine, a token, and the run until it is ended."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from ..errors import MissingExtraError
from .address import HOST, Address, address_file, keep, new_token
from .folder import Files


def check_extra() -> None:
    """Raise a MissingExtraError if what the server is made with is not installed."""
    if not all(find_spec(name) for name in ("scipy", "starlette", "uvicorn")):
        raise MissingExtraError("the studio", "studio")


def open_socket(port: int) -> socket.socket:
    """A socket of this machine alone; port 0 stands for any that is free.

    Raises
    ------
    OSError
        If something else has the port.
    """
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if os.name != "nt":  # after a crash; on Windows it would let others listen, too
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((HOST, port))
        opened.listen()
    except OSError as error:
        opened.close()
        if error.errno == errno.EADDRINUSE:
            raise OSError(f"port {port} is in use: leave --port out, or name another") from None
        raise OSError(f"port {port}: {error.strerror or error}") from None
    return opened


def open_again(port: int | None, kept: Address | None) -> tuple[socket.socket, Address]:
    """A socket and an address: the port asked for, or that of the last server if it is free."""
    if port is None and kept is not None:
        with contextlib.suppress(OSError):
            return open_socket(kept.port), kept
    opened = open_socket(port or 0)
    number = opened.getsockname()[1]
    is_same = kept is not None and kept.port == number
    return opened, kept if kept is not None and is_same else Address(number, new_token())


def serve(
    files: Files, opened: socket.socket, address: Address, on_start: Callable[[str], object]
) -> None:
    """Serve until an interrupt or a request ends it; `on_start` gets the address to open."""
    import uvicorn

    from .app import Studio, studio_app
    from .connections import BACKLOG, Connection
    from .security import page_address

    studio = Studio(files, lambda: setattr(server, "should_exit", True))
    config = uvicorn.Config(
        studio_app(studio, address.token, address.port), log_level="error", access_log=False,
        http=Connection, lifespan="off", ws="none", server_header=False, proxy_headers=False,
        backlog=BACKLOG, timeout_graceful_shutdown=2,
    )  # fmt: skip
    server: Any = _server(
        uvicorn, config, lambda: on_start(page_address(address)), studio.thumbnails.close
    )
    try:
        with keep(address_file(files.place), address), contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[opened])
    finally:
        files.close()


def _server(
    uvicorn: Any, config: Any, on_start: Callable[[], object], on_end: Callable[[], object]
) -> Any:
    class Server(uvicorn.Server):  # type: ignore[misc]  # uvicorn is imported where it is needed
        async def startup(self, sockets: Any = None) -> None:
            await super().startup(sockets=sockets)
            on_start()

        async def shutdown(self, sockets: Any = None) -> None:
            on_end()  # before the server waits for running requests
            await super().shutdown(sockets=sockets)

    return Server(config)
