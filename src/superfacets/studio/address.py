"""Port and token of a server: chosen, stored for the next start, and passed to a browser.

The next server for the same work answers at the same address, so an open page goes on working after
its server was killed. Only the owner can read the stored address. It is removed when a server ends.
"""

from __future__ import annotations

import contextlib
import errno
import html
import json
import os
import re
import secrets
import socket
import stat
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

HOST = "127.0.0.1"  # the only interface that the server listens on
TOKEN_VARIABLE = "SUPERFACETS_STUDIO_TOKEN"
"""Environment variable with the token, for scripts."""

_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}")

_REDIRECTION = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>superfacets studio</title>
<meta http-equiv="refresh" content="0; url={0}">
<p><a href="{0}">Open the studio</a></p></html>
"""

_FOR_OTHERS = stat.S_IRWXG | stat.S_IRWXO


@dataclass(frozen=True)
class Address:
    """Address of a server, and its token."""

    port: int
    token: str

    @property
    def page(self) -> str:
        """The address for a browser, with the token."""
        return f"http://{HOST}:{self.port}/?token={self.token}"


def new_token() -> str:
    """The token of the environment, or a random one; a ValueError if a given one is bad."""
    given = os.environ.get(TOKEN_VARIABLE)
    if given is None:
        return secrets.token_urlsafe(24)
    if not _TOKEN.fullmatch(given):
        raise ValueError(f"{TOKEN_VARIABLE} must have 16 characters or more of A-Z a-z 0-9 _ -")
    return given


def open_socket(port: int) -> socket.socket:
    """A socket for this machine only; port 0 means any free port. An OSError if it is in use."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if os.name != "nt":  # after a crash; on Windows it would let others listen, too
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((HOST, port))
        opened.listen()
    except OSError as error:
        opened.close()
        if error.errno == errno.EADDRINUSE:
            raise OSError(f"port {port} is in use: name another --port, or none") from None
        raise OSError(f"port {port}: {error.strerror or error}") from None
    return opened


def open_again(port: int | None, kept: Address | None) -> tuple[socket.socket, Address]:
    """A socket and an address: the given port, or else the last server's port if it is free."""
    if port is None and kept is not None:
        with contextlib.suppress(OSError):
            return open_socket(kept.port), kept
    opened = open_socket(port or 0)
    number = opened.getsockname()[1]
    if kept is not None and kept.port == number:
        return opened, kept
    return opened, Address(number, new_token())


def address_file(work: Path) -> Path:
    """The file that stores the address of the server for a work file or a folder."""
    if work.is_dir():
        return work / ".superfacets-studio.address"
    return work.with_name(f".{work.name}.address")


def kept_address(path: Path) -> Address | None:
    """The address that an earlier server has stored; None if there is none, or it is not trusted.

    A file is not trusted if it belongs to another user, if others may read or write it, or if it is
    a copy. A copy may come with an archive of meshes, from somebody who knows the token.
    """
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        status = path.lstat()
        is_own = not hasattr(os, "getuid") or status.st_uid == os.getuid()
        is_closed = os.name == "nt" or not status.st_mode & _FOR_OTHERS
        if stat.S_ISREG(status.st_mode) and is_own and is_closed:
            found = json.loads(path.read_text(encoding="ascii"))
            port, token = found["port"], found["token"]
            is_copy = found["inode"] != status.st_ino
            is_port = isinstance(port, int) and 0 < port < 1 << 16
            if is_port and _TOKEN.fullmatch(token) and not is_copy:
                return Address(port, token)
    return None


@contextlib.contextmanager
def keep(path: Path, address: Address) -> Iterator[None]:
    """Store an address for the duration of a block; without write access, it is not stored."""
    text = ""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
        with _own_file(path) as writer:
            inode = os.fstat(writer.fileno()).st_ino
            text = json.dumps({"port": address.port, "token": address.token, "inode": inode})
            writer.write(text)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            if path.read_text(encoding="ascii") == text:  # else another server has written it
                path.unlink()


@contextlib.contextmanager
def redirection(page: str) -> Iterator[str]:
    """Yield the address of a temporary file that redirects a browser to a page.

    All users can see the arguments of a process, so the browser is not started with the token. Only
    the owner can read the file.
    """
    with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
        path = Path(folder, "studio.html")
        with _own_file(path) as writer:
            writer.write(_REDIRECTION.format(html.escape(page)))
        yield path.as_uri()


def _own_file(path: Path) -> IO[str]:
    """Create a file that only its owner can read."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    return os.fdopen(file, "w", encoding="ascii")
