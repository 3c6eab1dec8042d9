"""Worker processes of this machine: start, messages and end."""

import os
import random
import signal
import subprocess
import sys
import time
from multiprocessing import Pipe
from pathlib import Path

import pytest
from local_workers import servers, worker_processes

from superfacets import MissingExtraError
from superfacets._validate import checked_threads
from superfacets.workers import calls, pool, start
from superfacets.workers.calls import Done, Failed, Killed
from superfacets.workers.pool import open_pool

linux = pytest.mark.skipif(sys.platform != "linux", reason="there is no fork server here")


@pytest.fixture(params=[pytest.param(True, marks=linux), False], ids=["forked", "spawned"])
def either(request, monkeypatch):
    """Start workers by a fork server, or without one."""
    monkeypatch.setattr(start, "HAS_SERVER", request.param)


def run(team, function, *arguments, **options):
    """Return the outcomes of calls of a function, in the order of the arguments."""
    endings = dict(team.run([(function, (argument,)) for argument in arguments], **options))
    assert sorted(endings) == list(range(len(arguments)))
    return [endings[place] for place in range(len(arguments))]


def double(number):
    return 2 * number


def test_each_call_is_made_once(either):
    with open_pool(2) as team:
        assert run(team, double, *range(50)) == [Done(2 * n) for n in range(50)]
        assert run(team, double, 7) == [Done(14)]
        assert len(worker_processes()) == 2
    assert worker_processes() == []


def end_if(number):
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_call_that_kills_workers_is_given_up_and_costs_the_others_nothing(either):
    with open_pool(2, allowed_kills=1) as team:
        found = run(team, end_if, *range(8))
    assert found == [Killed(2) if n == 3 else Done(n) for n in range(8)]


def wait_and_double(number):
    time.sleep(0.002)
    return 2 * number


@pytest.mark.parametrize("seed", range(3))
def test_workers_that_are_killed_at_any_time_lose_no_call(seed):
    chance = random.Random(seed)
    found = {}
    with open_pool(2, allowed_kills=100) as team:
        for place, ending in team.run([(wait_and_double, (n,)) for n in range(300)]):
            found[place] = ending
            if len(found) % 20 == 0 and (there := worker_processes()):
                chance.choice(there).kill()
    assert found == {n: Done(2 * n) for n in range(300)}


class OddError(Exception):
    """An error that cannot be created again from its arguments."""

    def __init__(self, one, two):
        super().__init__(f"{one} and {two}")


class Unreadable:
    def __reduce__(self):
        return fail, ("not to be read",)


def fail(text):
    if text == "odd":
        raise OddError(1, 2)
    if text == "exit":
        sys.exit("bye")
    if text == "unreadable":
        return Unreadable()
    if text == "function":
        return lambda: None
    raise ValueError(text)


def test_errors_come_back_and_so_does_that_a_result_cannot():
    with open_pool(1) as team:
        found = run(team, fail, "wrong", "odd", "exit", "unreadable", "function")
    assert all(isinstance(ending, Failed) for ending in found)
    wrong, odd, ended, unreadable, function = (ending.error for ending in found)
    assert (type(wrong), str(wrong)) == (ValueError, "wrong")
    assert (type(odd), str(odd)) == (RuntimeError, "OddError: 1 and 2")
    assert (type(ended), str(ended)) == (RuntimeError, "SystemExit: bye")
    assert (type(unreadable), str(unreadable)) == (ValueError, "not to be read")
    assert "pickle" in str(function)


def fill(n_bytes):
    data = bytearray(n_bytes)
    data[::4096] = b"x" * len(data[::4096])
    time.sleep(20 if n_bytes > 1 << 28 else 0)


def test_a_worker_that_uses_more_than_its_share_is_ended():
    with open_pool(2, memory=2 << 28, allowed_kills=0) as team:
        assert team.share == 1 << 28
        assert run(team, fill, 1 << 20, 3 << 28, 1 << 20) == [Done(None), Killed(1), Done(None)]


def test_memory_cannot_be_watched_without_psutil(monkeypatch):
    monkeypatch.setitem(sys.modules, "psutil", None)
    with pytest.raises(MissingExtraError, match=r"superfacets\[batch\]"):
        open_pool(2).__enter__()


def test_a_worker_of_one_thread_also_reads_on_one():
    with open_pool(1) as team:
        assert list(team.run([(checked_threads, (None,))])) == [(0, Done(1))]


def libraries(_):
    return os.environ["OPENBLAS_NUM_THREADS"], sys.modules["__main__"].__name__


def test_libraries_have_one_thread_there_and_here_as_many_as_before(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    before = dict(os.environ), sys.modules["__main__"]
    with open_pool(1) as team:
        assert run(team, libraries, 0)[0].value[0] == "1"
    assert (dict(os.environ), sys.modules["__main__"]) == before


def test_calls_wait_until_they_are_admitted():
    def is_first_or_alone(place, at_work):
        return not at_work or place == 0

    with open_pool(2) as team:
        found = list(team.run([(double, (n,)) for n in range(5)], admits=is_first_or_alone))
    assert found == [(n, Done(2 * n)) for n in range(5)]


@linux
def test_a_server_that_is_killed_is_replaced():
    with open_pool(2) as team:
        assert run(team, double, 1) == [Done(2)]
        for process in [*servers(), *worker_processes()]:
            process.kill()
        assert run(team, double, *range(5)) == [Done(2 * n) for n in range(5)]


@linux
def test_the_server_is_started_ahead_where_a_second_core_can_run_it(monkeypatch):
    psutil = pytest.importorskip("psutil")
    for process in servers():
        process.kill()
        # Not `wait`, which would hide the end of the process from the module that started it.
        while process.is_running() and process.status() != psutil.STATUS_ZOMBIE:
            time.sleep(0.01)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    start.prepare()
    assert servers() == []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    start.prepare()
    deadline = time.monotonic() + 60
    while not servers() and time.monotonic() < deadline:  # it must still become its own program
        time.sleep(0.01)
    (prepared,) = servers()
    with open_pool(1) as team:
        run(team, double, 1)
        assert servers() == [prepared]


def end(*_):
    os._exit(1)


def test_workers_that_never_begin_are_an_error(monkeypatch):
    monkeypatch.setattr(pool, "serve", end)
    with (
        open_pool(2) as team,
        pytest.raises(
            ConnectionError,
            match=r"worker processes cannot be started: 10 of them died before they were ready"
            r" \(out of memory\?\)",
        ),
    ):
        run(team, double, 1)


def test_workers_that_the_system_has_no_room_for_are_an_error(monkeypatch):
    def refuse(*_):
        raise BlockingIOError

    monkeypatch.setattr("multiprocessing.process.BaseProcess.start", refuse)
    with open_pool(2) as team, pytest.raises(ConnectionError, match="cannot be started"):
        run(team, double, 1)


def test_a_machine_without_room_for_more_workers_goes_on_with_those_there_are(monkeypatch):
    started = []
    begin = pool._Process.__init__

    def fail_after_the_first(process, *arguments):
        begin(process, *arguments)
        if started:
            process.connection.close()
            process.connection, theirs = Pipe()
            theirs.close()
        started.append(process)

    monkeypatch.setattr(pool._Process, "__init__", fail_after_the_first)
    monkeypatch.setattr(pool, "PAUSE", 0.0)
    monkeypatch.setattr(calls, "ALLOWED_KILLS", 100)
    with open_pool(2) as team:
        assert run(team, wait_and_double, *range(200)) == [Done(2 * n) for n in range(200)]
    assert len(started) > 2


LONG = """
import os
import time
from superfacets.workers.pool import open_pool

def wait(folder):
    open(f"{folder}/{os.getpid()}", "w").close()
    time.sleep(60)

if __name__ == "__main__":
    with open_pool(2) as team:
        from long import wait  # workers know it by this name

        list(team.run([(wait, (PIDS,))] * 2))
"""


@linux
def test_workers_end_with_who_started_them_even_amid_a_call(tmp_path):
    pids = tmp_path / "pids"
    pids.mkdir()
    (tmp_path / "long.py").write_text(LONG.replace("PIDS", repr(str(pids))))
    driver = subprocess.Popen([sys.executable, str(tmp_path / "long.py")])
    while len(found := list(pids.iterdir())) < 2:
        time.sleep(0.02)
    driver.kill()
    driver.wait()
    deadline = time.monotonic() + 10
    while any(Path("/proc", path.name).exists() for path in found):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_calls_of_a_run_that_is_left_are_not_finished():
    with open_pool(1) as team:
        ends = team.run([(double, (1,)), (time.sleep, (60,)), (double, (2,))])
        assert next(ends) == (0, Done(2))
        began = time.monotonic()
        ends.close()
        assert run(team, double, 3) == [Done(6)]
        assert time.monotonic() < began + 10
