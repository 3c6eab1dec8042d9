"""Tasks in worker processes: records, failures, and workers that die."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
from research.tasks import WorkItem, read_item, read_record, run_shown, run_tasks, write_record


@dataclass(frozen=True)
class Square:
    number: int
    memory: int = 0

    def run(self):
        return self.number**2


@dataclass(frozen=True)
class Suicide:
    memory: int = 0

    def run(self):
        os.kill(os.getpid(), signal.SIGKILL)


@dataclass(frozen=True)
class Exit:
    memory: int = 0

    def run(self):
        os._exit(3)


@dataclass(frozen=True)
class Nap:
    """Records the process it runs in, and sleeps."""

    path: Path
    memory: int = 0

    def run(self):
        self.path.write_text(str(os.getpid()))
        time.sleep(60)


def test_a_worker_runs_no_code_of_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "multiprocessing.py").write_text("open('PWNED', 'w')")
    monkeypatch.chdir(tmp_path)
    assert dict(run_shown("test", [Square(2)], 1, memory=0)) == {Square(2): 4}
    assert not (tmp_path / "PWNED").exists()


def test_a_worker_that_dies_takes_only_its_job_along():
    jobs = [Square(2), Suicide(), Exit(), Square(3)]
    ends = dict(run_shown("test", jobs, 2, memory=0))
    assert (ends[Square(2)], ends[Square(3)]) == (4, 9)
    for deadly in (Suicide(), Exit()):
        assert "a worker ended during this job (out of memory?)" in str(ends[deadly])


def test_an_error_of_a_job_is_raised():
    with pytest.raises(TypeError, match="unsupported operand"):
        list(run_shown("test", [Square("2")], 1, memory=0))


def test_a_job_too_large_for_memory_runs_alone():
    jobs = [Square(1, memory=60), Square(2, memory=60), Square(3, memory=500), Square(4)]
    ends = run_shown("test", jobs, 2, memory=100)
    assert sorted(result for _, result in ends) == [1, 4, 9, 16]


def test_workers_end_when_their_parent_is_killed(tmp_path):
    script = (
        "from pathlib import Path\n"
        "from research.tasks import run_shown\n"
        "from test_tasks import Nap\n"
        "if __name__ == '__main__':\n"
        f"    list(run_shown('naps', [Nap(Path({str(tmp_path / 'pid')!r}))], 1, memory=0))\n"
    )
    (tmp_path / "parent.py").write_text(script)
    folders = [str(folder) for folder in Path(__file__).parents[:2]]
    path = {**os.environ, "PYTHONPATH": os.pathsep.join([*folders, *sys.path])}
    parent = subprocess.Popen([sys.executable, tmp_path / "parent.py"], env=path)
    wait_until(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text())
    worker = int((tmp_path / "pid").read_text())
    parent.kill()
    parent.wait()
    wait_until(lambda: not is_alive(worker))


def wait_until(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@dataclass(frozen=True)
class Divisions:
    """Computes 1 over each number; the number "death" kills the worker."""

    items: tuple[WorkItem, ...]
    cannot: str = ""
    memory: int = 0

    def prepare(self):
        if self.cannot:
            raise ValueError(self.cannot)
        return self.divide

    def divide(self, item):
        if item.subject == "death":
            os.kill(os.getpid(), signal.SIGKILL)
        return {"value": 1 / item.subject}


def items_of(folder, *subjects):
    return tuple(WorkItem(s, folder / f"{s}.json", {"subject": s}) for s in subjects)


def run_all(*tasks):
    return run_tasks("test", tasks, 2, memory=0)


def test_pieces_have_records_of_values_and_of_failures(tmp_path):
    items = items_of(tmp_path, 2, 0, 4)
    assert run_all(Divisions(items)) == {}
    assert [read_item(item) for item in items] == [
        {"value": 0.5},
        {"reason": "ZeroDivisionError: division by zero"},
        {"value": 0.25},
    ]


def test_what_cannot_be_prepared_fails_all_pieces(tmp_path):
    items = items_of(tmp_path, 2, 4)
    assert run_all(Divisions(items, cannot="no\nmesh")) == {}
    assert [read_item(item) for item in items] == 2 * [{"reason": "ValueError: no mesh"}]


def test_the_death_of_a_worker_is_recorded_for_what_it_did_not_come_to(tmp_path):
    done, deadly, lost = items = items_of(tmp_path, 2, "death", 4)
    write_record(lost.path, lost.key, {"reason": "an earlier one"})
    assert run_all(Divisions(items), Divisions(items_of(tmp_path / "other", 8))) == {}
    assert read_item(done) == {"value": 0.5}
    for item in (deadly, lost):
        assert "a worker ended" in read_item(item)["reason"]
    assert read_item(*items_of(tmp_path / "other", 8)) == {"value": 0.125}


def test_a_record_that_cannot_be_written_is_told(tmp_path):
    items = blocked, dead, done = items_of(tmp_path, 2, "death", 4)
    blocked.path.mkdir()
    dead.path.mkdir()
    lost = run_all(Divisions((blocked, done)), Divisions((dead,)))
    assert set(lost) == {blocked.path, dead.path}
    assert lost[blocked.path].startswith("the record could not be written: IsADirectoryError: ")
    assert [read_item(item) for item in items] == [None, None, {"value": 0.25}]


def test_no_task_is_begun_after_the_deadline(tmp_path):
    items = items_of(tmp_path, 2)
    past = time.monotonic() - 1
    assert run_tasks("test", [Divisions(items)], 1, memory=0, deadline=past) == {}
    assert read_item(*items) is None


def test_records_are_whole_or_none(tmp_path):
    path, key = tmp_path / "a" / "b.json", {"k": 5}
    record = {"metrics": {"x": 0.1 + 0.2}, "seconds": {"total": 1.25}}
    assert read_record(path, key) is None
    write_record(path, key, record)
    assert read_record(path, key) == record
    assert read_record(path, {"k": 6}) is None
    whole = path.read_text()
    stale = json.dumps(json.loads(whole) | {"key": {"k": 6}})
    texts = ["", "[]", "{}", "null", '{"key": {"k": 5}}', "\xff", whole[:-20], 99_999 * "[", stale]
    texts += [whole.replace("0.30000000000000004", "0.3000000000000001")]
    texts += [
        whole.replace('"record": {', '"record": [], "x": {'),
        re.sub("[0-9a-f]{32}", "", whole),
    ]
    for text in texts:
        assert text != whole
        path.write_text(text, encoding="latin-1")
        assert read_record(path, key) is None


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_record_of_numbers_that_are_not_finite_is_refused(tmp_path, value):
    with pytest.raises(ValueError, match="JSON"):
        write_record(tmp_path / "a.json", {}, {"metrics": {"compactness": value}})
    assert not list(tmp_path.iterdir())
