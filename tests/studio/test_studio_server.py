"""Clients that keep the server waiting, and too many clients."""

import contextlib
import signal
import socket
import subprocess
import threading
import time

import httpx
import pytest
from studio_client import TOKEN, Server

from superfacets_studio.documents.files import Files
from superfacets_studio.web.address import TOKEN_VARIABLE, open_again
from superfacets_studio.web.server import MAX_CONNECTIONS, serve

WAIT = 30
HALF = b"POST /api/files/0/paint HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture
def port(sheet, monkeypatch, limit):
    """Yield the port of a studio in a thread of this process, whose timeout is short."""
    limit("wait for a request", 0.3)
    monkeypatch.setenv(TOKEN_VARIABLE, TOKEN)
    opened, address = open_again(0, None)
    started = threading.Event()
    files = Files.of(sheet, None, 20, ())
    with opened:
        server = threading.Thread(
            target=serve, args=(files, opened, address, lambda _: started.set())
        )
        server.start()
        assert started.wait(WAIT)
        yield address.port
        httpx.post(f"http://127.0.0.1:{address.port}/api/quit", headers={"X-Token": TOKEN})
        server.join(WAIT)
        assert not server.is_alive()


def connected(port):
    return socket.create_connection(("127.0.0.1", port), timeout=WAIT)


def head(port, method="GET", name="state", **headers):
    lines = [f"{method} /api/files/0/{name} HTTP/1.1", f"Host: 127.0.0.1:{port}"]
    lines += [f"{key.replace('_', '-')}: {value}" for key, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode()


def status(port):
    """Return the status of the answer to a well-behaved client."""
    return httpx.get(
        f"http://127.0.0.1:{port}/api/files", headers={"X-Token": TOKEN}, timeout=WAIT
    ).status_code


def is_closed(client):
    """Wait until the server closes the connection, and discard what it sends before."""
    with contextlib.suppress(ConnectionError):
        while client.recv(1 << 20):
            pass
    return True


def trickle(client, data):
    """Send data now and then until the server closes the connection; return whether it does."""
    end = time.monotonic() + WAIT
    with contextlib.suppress(ConnectionError):
        while time.monotonic() < end:
            client.sendall(data)
            time.sleep(0.05)
    return time.monotonic() < end


@pytest.mark.parametrize("sent", [b"", b"GET /", HALF])
def test_a_head_that_does_not_come_is_not_waited_for(port, sent):
    with connected(port) as client:
        client.sendall(sent)
        assert is_closed(client)


def test_a_head_that_comes_byte_by_byte_is_not_waited_for(port):
    with connected(port) as client:
        client.sendall(HALF + b"A: ")
        assert trickle(client, b"a")


def test_a_body_that_does_not_come_is_not_waited_for(port):
    with connected(port) as client:
        client.sendall(head(port, "POST", "paint", X_Token=TOKEN, Content_Length=10) + b"{")
        assert is_closed(client)


def test_a_body_that_is_refused_is_not_waited_for(port):
    with connected(port) as client:
        client.sendall(head(port, "POST", "paint", Content_Length=1000))
        assert client.recv(1000).startswith(b"HTTP/1.1 403")
        assert trickle(client, b"a")


def test_a_body_that_comes_slowly_is_waited_for(port):
    body = b'{"class":1,"cells":""}'
    with connected(port) as client:
        client.sendall(head(port, "POST", "paint", X_Token=TOKEN, Content_Length=len(body)))
        for place in range(len(body)):
            client.sendall(body[place : place + 1])
            time.sleep(0.05)
        assert client.recv(1000).startswith(b"HTTP/1.1 200")


def test_answers_that_nobody_reads_are_given_up(port):
    request = head(port, name="mesh", X_Token=TOKEN)
    with connected(port) as client:
        client.settimeout(1.0)
        end = time.monotonic() + WAIT
        with contextlib.suppress(ConnectionError):
            while time.monotonic() < end:
                with contextlib.suppress(TimeoutError):
                    client.sendall(request)
        assert time.monotonic() < end


def test_a_run_that_takes_longer_is_not_cut_off(port, monkeypatch):
    def slow(*_):
        time.sleep(1.5)
        return {"is": "done"}

    monkeypatch.setattr("superfacets_studio.web.app._segment_file", slow)
    answer = httpx.post(
        f"http://127.0.0.1:{port}/api/files/0/segment",
        headers={"X-Token": TOKEN}, json={}, timeout=WAIT,
    )  # fmt: skip
    assert answer.json() == {"is": "done"}


def test_of_too_many_connections_the_one_that_waited_longest_is_closed(port, limit):
    limit("wait for a request", 1000.0)
    with contextlib.ExitStack() as stack:
        clients = [stack.enter_context(connected(port)) for _ in range(MAX_CONNECTIONS)]
        for client in clients:
            client.sendall(HALF)
        assert status(port) == 200
        assert is_closed(clients[0])
        clients[-1].settimeout(0.2)
        with pytest.raises(TimeoutError):
            clients[-1].recv(1)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has other limits")
def test_half_sent_requests_beyond_the_limit_of_files_stop_nothing(sheet, limit):
    import resource

    def limit():
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))

    server = Server(sheet, preexec_fn=limit, stderr=subprocess.PIPE)
    port, once = int(server.base.rsplit(":", 1)[1]), {"Connection": "close"}
    try:
        with contextlib.ExitStack() as stack:
            for n in range(301):
                stack.enter_context(connected(port)).sendall(HALF)
                # Of too many connections, the server closes idle ones, such as one that is kept.
                assert n % 20 or server.http.get("state", headers=once).status_code == 200
        assert server.http.get("state", headers=once).status_code == 200
        server.process.send_signal(signal.SIGINT)
        assert server.process.communicate(timeout=WAIT) == ("", "")
        assert server.process.returncode == 0
    finally:
        server.close()
