"""Which requests the studio answers, and how."""

import os
import shutil

import pytest
from studio_client import PORT, TOKEN, Http

from superfacets_studio.web.address import (
    TOKEN_VARIABLE,
    Address,
    address_file,
    keep,
    new_token,
    stored_address,
)
from superfacets_studio.web.security import HEADERS, MAX_PATH

OWN = f"127.0.0.1:{PORT}"


def asked(client, path="/api/files", *, method="GET", host=OWN, token=TOKEN, **headers):
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    if token is not None:
        headers["X-Token"] = token
    http = Http(client.http._transport.app, base_url=f"http://{OWN}")
    return http.request(method, path, headers={"Host": host, **headers})


def test_a_request_of_the_page_is_answered(client):
    assert asked(client).status_code == 200
    assert asked(client, host=f"localhost:{PORT}").status_code == 200
    assert asked(client, Origin=f"http://{OWN}", Sec_Fetch_Site="same-origin").status_code == 200
    assert asked(client, f"/api/files?token={TOKEN}", token=None).status_code == 200
    for site in ("none", "cross-site"):  # a file leads the browser there
        assert asked(client, f"/?token={TOKEN}", token=None, Sec_Fetch_Site=site).status_code == 200
    assert asked(client, "/", token=None, Sec_Fetch_Site="cross-site").status_code == 403


def test_a_path_has_a_greatest_length(client):
    longest = "/api/files/".ljust(MAX_PATH, "x")
    assert asked(client, longest).status_code == 404
    assert asked(client, longest + "x").status_code == 414


@pytest.mark.parametrize("path", ["/", "/api/files", "/api/files/0/mesh", "/api/quit", "/nothing"])
@pytest.mark.parametrize("token", [None, "", "wrong", TOKEN[:-1], TOKEN + "x", "\u00fc"])
def test_without_the_token_nothing_is_told(client, path, token):
    headers = {} if token is None or not token.isascii() else {"X-Token": token}
    query = "" if token is None or token.isascii() else f"?token={token}"
    http = Http(client.http._transport.app, base_url=f"http://{OWN}")
    for method in ("GET", "POST", "PUT", "OPTIONS"):
        answer = http.request(method, path + query, headers=headers)
        assert answer.status_code == 403
        assert "the token is missing or wrong" in answer.text
        assert "sheet" not in answer.text
    assert client.quits == 0


@pytest.mark.parametrize("headers", [
    {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": f"https://{OWN}"},
    {"Origin": "http://127.0.0.1:1"}, {"Sec_Fetch_Site": "cross-site"},
    {"Sec_Fetch_Site": "same-site"},
])  # fmt: skip
def test_another_page_is_refused_even_with_the_token(client, headers):
    answer = asked(client, "/api/quit", method="POST", **headers)
    assert answer.status_code == 403
    assert answer.json() == {"error": "the request comes from a page of another site"}
    assert client.quits == 0


@pytest.mark.parametrize("host", ["evil.example", f"evil.example:{PORT}", "127.0.0.1:1", ""])
def test_another_name_of_the_host_is_refused(client, host):
    answer = asked(client, host=host)
    assert answer.status_code == 403
    assert "the address that it has printed" in answer.json()["error"]


def test_every_answer_has_the_headers(client):
    for answer in (asked(client), asked(client, token="x"), asked(client, f"/?token={TOKEN}")):
        assert {name: answer.headers[name] for name in HEADERS} == HEADERS
        assert "access-control-allow-origin" not in answer.headers
        assert "server" not in answer.headers


def test_too_large_a_request_is_refused_unread(client):
    answer = asked(client, "/api/files/0/paint", method="POST", Content_Length=str(1 << 31))
    assert answer.status_code == 413


@pytest.mark.parametrize("name", ["paint", "segment"])
def test_no_more_is_taken_of_a_body_than_there_may_be(client, limit, name):
    limit("bytes of a request", 10_000)
    n_taken = 0

    async def endless():
        nonlocal n_taken
        while True:
            n_taken += 1000
            yield b" " * 1000

    answer = client.http.post(f"/api/files/0/{name}", content=endless())
    assert (answer.status_code, n_taken) == (413, 11_000)
    assert answer.json() == {"error": "the request is larger than 10000 bytes"}


@pytest.mark.parametrize("path", [
    "/static/../app.py", "/static/..%2fapp.py", "/static/%2e%2e/app.py", "/static//etc/passwd",
    "/static/%2fetc%2fpasswd", "/static/..\\app.py", "/../sheet.ply",
    "/api/files/0/../../../sheet.ply", "/api/files/-1/mesh", "/api/files/0x0/mesh",
    "/sheet.ply", "/sheet.ply.studio.jsonl",
])  # fmt: skip
def test_no_path_leads_outside(client, path):
    answer = asked(client, path)
    assert answer.status_code in (404, 405)
    assert answer.json()["error"].startswith("unknown route: GET")


def test_a_websocket_is_not_answered(client):
    import asyncio

    sent = []

    async def connect():
        scope = {"type": "websocket", "path": "/", "headers": [], "query_string": b""}
        await client.http._transport.app(scope, None, sent.append)

    asyncio.run(connect())
    assert sent == []


def test_the_token_is_random_or_that_of_the_environment(monkeypatch):
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    assert new_token() != new_token()
    monkeypatch.setenv(TOKEN_VARIABLE, TOKEN)
    assert Address(80, new_token()).page == f"http://127.0.0.1:80/?token={TOKEN}"
    for text in ("short", "x" * 20 + "&", ""):
        monkeypatch.setenv(TOKEN_VARIABLE, text)
        with pytest.raises(
            ValueError,
            match="SUPERFACETS_STUDIO_TOKEN must have 16 to 200 characters of A-Z a-z 0-9 _ -",
        ):
            new_token()


def test_an_address_is_kept_for_its_owner_as_long_as_the_server_runs(tmp_path):
    path, address = address_file(tmp_path / "work.jsonl"), Address(8765, TOKEN)
    assert path.name == ".work.jsonl.address"
    assert address_file(tmp_path).parent == tmp_path
    path.write_text("old")
    with keep(path, address):
        assert stored_address(path) == address
        if os.name != "nt":
            assert path.stat().st_mode & 0o777 == 0o600
    assert not path.exists()
    with keep(path, address):
        path.write_text("of another server")
    assert path.exists()
    with keep(tmp_path / "none" / "file", address):  # the folder does not exist
        pass


@pytest.mark.skipif(os.name == "nt", reason="files have no permissions there")
def test_an_address_that_others_may_have_written_is_not_trusted(tmp_path, monkeypatch):
    path = tmp_path / "address"
    assert stored_address(path) is None
    for text in ("no", "[]", '{"port":8765,"token":"short"}', f'{{"port":0,"token":"{TOKEN}"}}'):
        path.write_text(text)
        path.chmod(0o600)
        assert stored_address(path) is None
    inode = path.stat().st_ino
    path.write_text(f'{{"port":8765,"token":"{TOKEN}","inode":{inode}}}')
    assert stored_address(path) == Address(8765, TOKEN)
    copy = shutil.copy2(path, tmp_path / "copy")  # as from an archive that somebody sent
    assert stored_address(copy) is None
    path.chmod(0o604)
    assert stored_address(path) is None
    path.chmod(0o600)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert stored_address(path) is None
    monkeypatch.undo()
    link = tmp_path / "link"
    link.symlink_to(path)
    assert stored_address(link) is None
