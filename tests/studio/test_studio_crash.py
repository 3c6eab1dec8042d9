"""The server is killed at random moments: acknowledged operations and at most one more survive."""

import random
import signal
import threading
import time

import httpx
import numpy as np
import pytest
import shapes
from studio_client import Server, encoded

from superfacets import write_mesh
from superfacets_studio.documents.changes import Change

N_ROUNDS = 4


class Worker:
    """Paints, undoes and redoes at random, and knows the expected state."""

    def __init__(self, n_cells, seed):
        self.random = random.Random(seed)
        self.state = np.zeros(n_cells, np.uint16)
        self.next = self.state  # after the pending operation
        self.done, self.undone = [], []
        self.n_acknowledged = 0
        self.first_acknowledged = threading.Event()

    def work(self, http):
        """Send operations until the server does not answer."""
        try:
            while True:
                self.step(http)
        except httpx.TransportError:
            return

    def step(self, http):
        name = self.random.choice(["paint", "paint", "paint", "undo", "redo"])
        source, target = (self.done, self.undone) if name == "undo" else (self.undone, self.done)
        if name == "paint":
            number, size = self.random.randint(1, 6), self.random.randint(1, 200)
            cells = np.unique(self.random.choices(range(len(self.state)), k=size)).astype(np.uint32)
            self.next = self.state.copy()
            self.next[cells] = number
            body = {"class": number, "cells": encoded(cells)}
            changed = Change.painting(self.state, cells, number) is not None
        elif source:
            body, changed, self.next = {}, True, source[-1]
        else:
            return
        answer = http.post(name, json=body)
        assert answer.status_code == 200, answer.text
        self.settle(name, source, target, changed=changed)

    def settle(self, name, source, target, *, changed):
        """Record that the pending operation succeeded."""
        if name == "paint" and changed:
            self.done.append(self.state)
            self.undone.clear()
        elif name != "paint":
            source.pop()
            target.append(self.state)
        self.state = self.next
        self.n_acknowledged += 1
        self.first_acknowledged.set()

    def check(self, found):
        """Check for the state last acknowledged, or that after the pending operation."""
        assert np.array_equal(found, self.state) or np.array_equal(found, self.next)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system cannot kill so")
def test_killed_at_any_moment_no_acknowledged_operation_is_lost(tmp_path):
    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(24))
    worker = Worker(1152, seed=7)
    total, addresses = 0, set()
    for round_number in range(N_ROUNDS):
        server = Server(path)
        try:
            addresses.add(server.address)
            found = server.classes()
            worker.check(found)
            # After an interrupted operation, the client does not know what can be undone.
            worker.state = worker.next = found.copy()
            worker.done, worker.undone = [], []
            thread = threading.Thread(target=worker.work, args=(server.http,))
            thread.start()
            worker.first_acknowledged.wait(60)  # on a slow machine, the first operation takes long
            time.sleep(worker.random.uniform(0.05, 0.5))
            server.kill()
            thread.join()
        finally:
            server.close()
        total += worker.n_acknowledged
        assert total, round_number
    assert len(addresses) == 1  # an open page continues to work
    journal = path.with_name("sheet.ply.studio.jsonl")
    cut = journal.read_bytes()[:-9]  # cut in the middle of a line
    journal.write_bytes(cut)
    server = Server(path)
    try:
        notes = server.http.get("state").json()["notes"]
        assert any("was left out" in note for note in notes)
        assert server.http.get("state").json()["seq"] == cut.count(b"\n") - 1
        httpx.post(f"{server.base}/api/quit", headers={"X-Token": server.token})
        assert server.process.wait(20) == 0
        assert not list(tmp_path.glob(".*address"))
    finally:
        server.close()


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="the system ends processes otherwise")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_server_that_is_ended_leaves_no_address(tmp_path, name):
    write_mesh(tmp_path / "sheet.ply", shapes.bumpy_sheet(4))
    server = Server(tmp_path / "sheet.ply")
    try:
        assert list(tmp_path.glob(".*address"))
        server.process.send_signal(getattr(signal, name))
        assert server.process.wait(20) == 0
    finally:
        server.close()
    assert not list(tmp_path.glob(".*address"))


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system interrupts otherwise")
def test_ctrl_c_ends_the_server_with_all_work_on_the_disk(tmp_path):
    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(24))
    server = Server(path)
    try:
        server.http.post("paint", json={"class": 1, "cells": encoded([3])})
        server.process.send_signal(signal.SIGINT)
        assert server.process.wait(20) == 0
    finally:
        server.close()
    assert not list(tmp_path.glob(".*address"))
    assert '"seq":1' in path.with_name("sheet.ply.studio.jsonl").read_text().splitlines()[-1]
