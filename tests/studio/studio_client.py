"""Clients of the server, which runs in this process or another, with the requests of the page."""

import asyncio
import base64
import json
import os
import signal
import subprocess
import sys

import httpx
import numpy as np
from front_end_arrays import decode_arrays

from superfacets_studio.documents.files import Files
from superfacets_studio.web.app import Studio, studio_app

TOKEN, PORT = "a-token-of-the-tests", 8765
COMMAND = """from superfacets_cli.main import main
from superfacets_studio.web import address
address.PORTS = ()  # of a server that is killed, no other test takes the port
main()"""


def encoded(cells):
    return base64.b64encode(np.asarray(cells, "<u4").tobytes()).decode()


def decoded(text, dtype="<u4"):
    return np.frombuffer(base64.b64decode(text), dtype)


def unpacked(content):
    """Return header and arrays of a binary answer."""
    assert content[:8] == b"SFSTUDIO"
    begin = 12 + int.from_bytes(content[8:12], "little")
    header = json.loads(content[12:begin])
    assert all(entry["offset"] % 4 == 0 for entry in header["arrays"])
    return header, decode_arrays(header["arrays"], content[begin:])


class Http:
    """Requests that are answered without a socket, one after another."""

    def __init__(self, app, **options):
        self._transport, self._options = httpx.ASGITransport(app), options

    def request(self, method, path, **options):
        async def answer():
            async with httpx.AsyncClient(transport=self._transport, **self._options) as client:
                return await client.request(method, path, **options)

        return asyncio.run(answer())

    def get(self, path, **options):
        return self.request("GET", path, **options)

    def post(self, path, **options):
        return self.request("POST", path, **options)


class Client:
    """Requests about the files of a studio."""

    def __init__(self, files, http):
        self.files, self.http = files, http
        self.quits = 0

    def document(self, file=0):
        with self.files.document(file) as document:
            return document

    def get(self, name, file=0, **query):
        return self.http.get(f"/api/files/{file}/{name}", params=query)

    def post(self, name, file=0, /, **body):
        return self.http.post(f"/api/files/{file}/{name}", json=body)

    def done(self, name, file=0, /, **body):
        """Return the answer of an operation, and check that it succeeded."""
        answer = self.post(name, file, **body)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def state(self, file=0):
        answer = self.get("state", file)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def classes(self, file=0):
        return np.frombuffer(self.get("paint", file).content, "<u4").astype(np.uint16)

    def objects(self, file=0):
        return np.frombuffer(self.get("paint", file).content, "<u4") >> 16

    def labels(self, file=0):
        revision = self.state(file)["revision"]
        return np.frombuffer(self.get("labels", file, revision=revision).content, "<i4")

    def paint_regions(self, class_id, *regions, file=0):
        """Give the cells of regions a class."""
        cells = np.flatnonzero(np.isin(self.labels(file), regions))
        return self.done("paint", file, **{"class": class_id}, cells=encoded(cells))

    def segment(self, **body):
        """Return all lines of a run."""
        return [json.loads(line) for line in self.post("segment", **body).text.splitlines()]

    def close(self):
        self.files.close()


def client_of(path, *, work=None, n_segments=None, classes=()):
    files = Files.of(path, work, n_segments, classes)
    client = Client(files, None)

    def quit_server():
        client.quits += 1

    app = studio_app(Studio(files, quit_server), TOKEN, PORT)
    client.http = Http(app, base_url=f"http://127.0.0.1:{PORT}", headers={"X-Token": TOKEN})
    return client


class Server:
    """A server in another process."""

    def __init__(self, path, **options):
        command = [sys.executable, "-c", COMMAND, "studio", str(path), "--no-browser", "-n", "20"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)
        words = self.process.stdout.readline().split()
        address = next(word for word in words if word.startswith("http"))
        self.base, self.token = address.split("/?token=")
        self.address = address
        self.http = httpx.Client(base_url=f"{self.base}/api/files/0/", timeout=30)
        self.http.headers["X-Token"] = self.token

    def classes(self):
        return np.frombuffer(self.http.get("paint").content, "<u4").astype(np.uint16)

    def kill(self):
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.http.close()
