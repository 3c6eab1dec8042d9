"""Choose the port and access token of a server, store them, and pass them to a browser.

The browser keeps view, tool, class and keys for each port, so servers use the first free port of
the same few. After its server was killed, the next server for a work file or folder uses the same
port and token, so a page that is still open works again. Only the owner can read the file with the
stored address. The file is removed when the server ends normally.
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

HOST = "127.0.0.1"  # the server accepts no connections from other machines
PORTS = range(28_400, 28_410)  # below the ports that systems hand out, and of no known service
TOKEN_VARIABLE = "SUPERFACETS_STUDIO_TOKEN"
"""Environment variable with a fixed token for scripts, instead of a random token."""

_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}")

_REDIRECTION = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>superfacets studio</title>
<meta http-equiv="refresh" content="0; url={0}">
<p><a href="{0}">Open the studio</a></p></html>
"""


@dataclass(frozen=True)
class Address:
    """Port of a server on this machine, and its access token."""

    port: int
    token: str

    @property
    def page(self) -> str:
        """URL to open in a browser, including the token."""
        return f"http://{HOST}:{self.port}/?token={self.token}"


def new_token() -> str:
    """Return the token in `TOKEN_VARIABLE`, or a random token if the variable is not set.

    Raises ValueError if the variable contains no well-formed token.
    """
    given = os.environ.get(TOKEN_VARIABLE)
    if given is None:
        return secrets.token_urlsafe(24)
    if not _TOKEN.fullmatch(given):
        raise ValueError(f"{TOKEN_VARIABLE} must have 16 to 200 characters of A-Z a-z 0-9 _ -")
    return given


def open_socket(port: int) -> socket.socket:
    """Return a socket that listens on a port (0: any free port); raise an OSError if this fails."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if os.name != "nt":  # on Windows, this option would let other processes use the port
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((HOST, port))
        opened.listen()
    except OSError as error:
        opened.close()
        if error.errno == errno.EADDRINUSE:
            message = f"port {port} is in use: choose another with --port, or omit --port"
            raise OSError(message) from None
        raise OSError(f"cannot listen on port {port}: {error.strerror or error}") from None
    return opened


def open_again(port: int | None, kept: Address | None) -> tuple[socket.socket, Address]:
    """Return a socket that listens on `port`, and the address of the server.

    If `port` is None, the port is the first free one of the port of `kept`, which is the address of
    a server that was killed, and of `PORTS`, or otherwise any free port. If the port differs from
    the port of `kept`, the server gets a new token.
    """
    usual = [*([] if kept is None else [kept.port]), *PORTS, 0]
    *tried, last = usual if port is None else [port]
    for number in tried:
        with contextlib.suppress(OSError):
            opened = open_socket(number)
            break
    else:
        opened = open_socket(last)
    number = opened.getsockname()[1]
    if kept is not None and kept.port == number:
        return opened, kept
    return opened, Address(number, new_token())


def address_file(work: Path) -> Path:
    """Return the path of the file that stores the server's address, for a work file or folder."""
    if work.is_dir():
        return work / ".superfacets-studio.address"
    return work.with_name(f".{work.name}.address")


def stored_address(path: Path) -> Address | None:
    """Return the address that an earlier server stored, or None if there is no trusted file.

    A file is not trusted if it belongs to another user, if other users may read or write it, or if
    it is a copy. A copy may come from an archive of meshes, and then its author knows the token.
    """
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        status = path.lstat()
        is_own = not hasattr(os, "getuid") or status.st_uid == os.getuid()
        is_closed = os.name == "nt" or not status.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
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
    """Store an address while the `with` block runs, unless the file cannot be written."""
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
            if path.read_text(encoding="ascii") == text:  # no other server replaced the file
                path.unlink()


@contextlib.contextmanager
def redirection(page: str) -> Iterator[str]:
    """Yield the URL of a temporary file that redirects a browser to a page.

    All users can see the arguments of a process, so the URL of the page, which contains the token,
    must not be an argument of the browser. Only the owner can read the temporary file.
    """
    with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
        path = Path(folder, "studio.html")
        with _own_file(path) as writer:
            writer.write(_REDIRECTION.format(html.escape(page)))
        yield path.as_uri()


def _own_file(path: Path) -> IO[str]:
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    return os.fdopen(file, "w", encoding="ascii")
