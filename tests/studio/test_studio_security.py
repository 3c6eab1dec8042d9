"""Who is answered by the studio, and with what."""

import pytest
from studio_client import PORT, TOKEN, Http

from superfacets.studio.security import HEADERS, page_address

OWN = f"127.0.0.1:{PORT}"


def asked(client, path="/api/files", *, method="GET", host=OWN, token=TOKEN, **headers):
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    if token is not None:
        headers["X-Token"] = token
    http = Http(client.http._transport.app, base_url=f"http://{OWN}")
    return http.request(method, path, headers={"Host": host, **headers})


def test_the_address_holds_the_token():
    assert page_address(80, "abc") == "http://127.0.0.1:80/?token=abc"


def test_a_request_of_the_page_is_answered(client):
    assert asked(client).status_code == 200
    assert asked(client, host=f"localhost:{PORT}").status_code == 200
    assert asked(client, Origin=f"http://{OWN}", Sec_Fetch_Site="same-origin").status_code == 200
    assert asked(client, f"/api/files?token={TOKEN}", token=None).status_code == 200
    assert asked(client, f"/?token={TOKEN}", token=None, Sec_Fetch_Site="none").status_code == 200


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


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": f"https://{OWN}"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_another_page_is_refused_even_with_the_token(client, headers):
    answer = asked(client, "/api/quit", method="POST", **headers)
    assert answer.status_code == 403
    assert answer.json() == {"error": "the request comes from another page"}
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


@pytest.mark.parametrize(
    "path",
    [
        "/static/../app.py",
        "/static/..%2fapp.py",
        "/static/%2e%2e/app.py",
        "/static//etc/passwd",
        "/static/%2fetc%2fpasswd",
        "/static/..\\app.py",
        "/../sheet.ply",
        "/api/files/0/../../../sheet.ply",
        "/api/files/-1/mesh",
        "/api/files/0x0/mesh",
        "/sheet.ply",
        "/sheet.ply.studio.jsonl",
    ],
)
def test_no_path_leads_outside(client, path):
    answer = asked(client, path)
    assert answer.status_code in (404, 405)
    assert answer.json()["error"].startswith("there is no GET")


def test_a_websocket_is_not_answered(client):
    import asyncio

    sent = []

    async def connect():
        scope = {"type": "websocket", "path": "/", "headers": [], "query_string": b""}
        await client.http._transport.app(scope, None, sent.append)

    asyncio.run(connect())
    assert sent == []
