"""Worker processes of this machine: how they begin, what they send, and how they end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from local_workers import templates, worker_processes

from superfacets.batches import memory, processes, serving, teams, template
from superfacets.batches.processes import local_team
from superfacets.batches.teams import Done, Failed, Killed

copies = pytest.mark.skipif(not template.CAN_COPY, reason="processes are not copied here")


@pytest.fixture(params=[pytest.param(True, marks=copies), False], ids=["copies", "new ones"])
def either(request, monkeypatch):
    """Workers that are copies of a template, and workers that are not."""
    monkeypatch.setattr(template, "CAN_COPY", request.param)


def run(team, function, *arguments):
    """What comes of calls of a function, in the order of the arguments."""
    calls = [(function, (argument,)) for argument in arguments]
    endings = dict(team.run(calls, None))
    assert sorted(endings) == list(range(len(calls)))
    return [endings[place] for place in range(len(calls))]


def double(number):
    return 2 * number


def test_each_call_is_made_once(either):
    with local_team(2) as team:
        assert run(team, double, *range(50)) == [Done(2 * n) for n in range(50)]
        assert run(team, double, 7) == [Done(14)]
        assert len(worker_processes()) == 2
    assert worker_processes() == templates() == []


def end_if(number):
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_call_that_kills_workers_is_given_up_and_costs_the_others_nothing(either, monkeypatch):
    monkeypatch.setattr(teams, "ALLOWED_KILLS", 1)
    with local_team(2) as team:
        found = run(team, end_if, *range(8))
    assert found == [Killed(2) if n == 3 else Done(n) for n in range(8)]


class OddError(Exception):
    """Cannot be made again from its arguments."""

    def __init__(self, one, two):
        super().__init__(f"{one} and {two}")


class Unreadable:
    def __reduce__(self):
        return fail, ("not to be read",)


def fail(text):
    if text == "odd":
        raise OddError(1, 2)
    if text == "unreadable":
        return Unreadable()
    if text == "function":
        return lambda: None
    raise ValueError(text)


def test_errors_come_back_and_so_does_that_a_result_cannot():
    with local_team(1) as team:
        found = run(team, fail, "wrong", "odd", "unreadable", "function")
    assert all(isinstance(ending, Failed) for ending in found)
    wrong, odd, unreadable, function = (ending.error for ending in found)
    assert (type(wrong), str(wrong)) == (ValueError, "wrong")
    assert (type(odd), str(odd)) == (RuntimeError, "OddError: 1 and 2")
    assert (type(unreadable), str(unreadable)) == (ValueError, "not to be read")
    assert "pickle" in str(function)


def fill(n_bytes):
    data = bytearray(n_bytes)
    data[::4096] = b"x" * len(data[::4096])
    time.sleep(20 if n_bytes > 1 << 28 else 0)


def test_a_worker_that_uses_more_than_its_share_is_ended(monkeypatch):
    monkeypatch.setattr(processes, "usable_memory", lambda: 2 << 28)
    monkeypatch.setattr(teams, "ALLOWED_KILLS", 0)
    with local_team(2) as team:
        assert team.share == 1 << 28
        assert run(team, fill, 1 << 20, 3 << 28, 1 << 20) == [Done(None), Killed(1), Done(None)]


def test_a_process_that_has_ended_uses_no_memory():
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    assert memory.used_by(ended.pid) == 0
    assert memory.used_by(os.getpid()) > 1 << 20


@copies
def test_a_template_that_is_killed_is_replaced():
    with local_team(2) as team:
        assert run(team, double, 1) == [Done(2)]
        for process in [*templates(), *worker_processes()]:
            process.kill()
        assert run(team, double, *range(5)) == [Done(2 * n) for n in range(5)]


@copies
def test_a_template_that_is_killed_before_its_copies_begin_is_replaced():
    with local_team(2) as team:
        for process in templates():
            process.kill()
        assert run(team, double, 1) == [Done(2)]


@copies
def test_a_team_that_is_not_used_ends_at_once():
    with local_team(2):
        pass
    assert worker_processes() == templates() == []


class Dead:
    """A template whose copies end before they begin."""

    def copy(self, n_threads):
        from multiprocessing.connection import Pipe

        ours, theirs = Pipe()
        theirs.close()
        return ours

    def close(self):
        pass

    kill = close


@copies
def test_workers_that_never_begin_are_an_error(monkeypatch):
    monkeypatch.setattr(template, "take_prepared", Dead)
    with (
        local_team(2) as team,
        pytest.raises(ConnectionError, match="cannot be started: each ended before it began"),
    ):
        run(team, double, 1)


def test_no_process_is_copied_where_there_can_be_no_more(monkeypatch):
    def refuse():
        raise BlockingIOError

    monkeypatch.setattr(os, "fork", refuse, raising=False)
    assert not serving._is_copy()


@copies
def test_the_prepared_template_is_used_once(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    template.prepare()
    (prepared,) = templates()
    with local_team(1) as team:
        run(team, double, 1)
        assert templates() == [prepared]
    template.prepare()
    template._discard_prepared()
    assert templates() == []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    template.prepare()
    assert templates() == []


LONG = """
import os
import time
from superfacets.batches.processes import local_team

def wait(folder):
    open(f"{folder}/{os.getpid()}", "w").close()
    time.sleep(60)

if __name__ == "__main__":
    with local_team(2) as team:
        from long import wait  # which workers know by this name

        list(team.run([(wait, ({pids!r},))] * 2, None))
"""


def test_workers_end_with_who_started_them_even_amid_a_task(tmp_path, monkeypatch):
    pids = tmp_path / "pids"
    pids.mkdir()
    (tmp_path / "long.py").write_text(LONG.replace("{pids!r}", repr(str(pids))))
    driver = subprocess.Popen([sys.executable, str(tmp_path / "long.py")])
    while len(found := list(pids.iterdir())) < 2:
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    deadline = time.monotonic() + 10
    while any(Path("/proc", path.name).exists() for path in found):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_tasks_of_a_run_that_is_left_are_not_finished():
    with local_team(1) as team:
        ends = team.run([(double, (1,)), (time.sleep, (60,)), (double, (2,))], None)
        assert next(ends) == (0, Done(2))
        began = time.monotonic()
        ends.close()
        assert run(team, double, 3) == [Done(6)]
        assert time.monotonic() < began + 10


def test_a_machine_without_room_for_more_workers_goes_on_with_those_there_are(monkeypatch):
    """A worker that ends before it begins costs nothing while another one is at work."""
    started = []
    start = processes.LocalTeam._start

    def fail_after_the_first(team):
        process = start(team)
        if started:
            process.connection.close()
            process.connection, theirs = processes.multiprocessing.Pipe()
            theirs.close()
        started.append(process)
        return process

    monkeypatch.setattr(processes.LocalTeam, "_start", fail_after_the_first)
    monkeypatch.setattr(processes, "MEMORY_TICK", 0.01)
    with local_team(2) as team:
        assert run(team, wait_and_double, *range(20)) == [Done(2 * n) for n in range(20)]
    assert len(started) > processes.START_ATTEMPTS


def wait_and_double(number):
    time.sleep(0.02)
    return 2 * number
