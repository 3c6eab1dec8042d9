"""Memory that a process may use: of the machine, of its control groups, or by a limit."""

import os
import subprocess
import sys

import pytest

from superfacets import _memory
from superfacets._memory import usable_memory


@pytest.fixture
def groups(tmp_path, monkeypatch):
    """Return a folder for files of control groups, and a function to set those of the process."""
    own = tmp_path / "own"
    monkeypatch.setattr(_memory, "_OWN_GROUPS", own)
    monkeypatch.setattr(_memory, "_GROUPS", tmp_path / "groups")
    return tmp_path / "groups", own.write_text


def write(folder, name, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text)


def test_without_limits_it_is_the_memory_of_the_machine(groups):
    _, enter = groups
    whole = usable_memory()
    assert whole > 1 << 27
    enter("0::/\n")
    assert usable_memory() == whole


@pytest.mark.parametrize("place", ["", "a.slice", "a.slice/b.scope"])
def test_the_limit_of_a_group_or_of_one_around_it_counts(groups, place):
    folder, enter = groups
    whole = usable_memory()
    enter("1:cpu:/x\n0::/a.slice/b.scope\n")
    for text, expected in (("123456789\n", 123456789), ("max\n", whole), (f"{2 * whole}", whole)):
        write(folder / place, "memory.max", text)
        assert usable_memory() == expected


def test_the_lowest_of_several_limits_counts(groups):
    folder, enter = groups
    enter("0::/a/b\n")
    write(folder, "memory.max", "300000000")
    write(folder / "a", "memory.max", "100000000")
    write(folder / "a" / "b", "memory.max", "200000000")
    assert usable_memory() == 100000000


def test_groups_of_the_first_version(groups):
    folder, enter = groups
    enter("5:cpu,memory:/a\n2:pids:/b\n")
    write(folder / "memory" / "a", "memory.limit_in_bytes", "123456789\n")
    write(folder / "memory" / "b", "memory.limit_in_bytes", "1\n")
    assert usable_memory() == 123456789


def test_a_group_that_a_container_does_not_see_is_that_of_its_root(groups):
    folder, enter = groups
    enter("5:memory:/hidden/deep\n")
    write(folder / "memory", "memory.limit_in_bytes", "123456789\n")
    assert usable_memory() == 123456789


def test_a_list_of_groups_in_another_form_tells_nothing(groups):
    folder, enter = groups
    whole = usable_memory()
    write(folder, "memory.max", "100000000")
    enter("nothing of the kind\n")
    assert usable_memory() == whole


LIMITED = """
import resource
from superfacets._memory import memory_of_process, usable_memory
whole = usable_memory()
assert memory_of_process() == whole
resource.setrlimit(resource.RLIMIT_AS, (1 << 27, 1 << 27))
assert memory_of_process() == 1 << 27
assert usable_memory() == whole
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs more")
def test_a_limit_of_the_address_space_counts_for_a_process():
    subprocess.run([sys.executable, "-c", LIMITED], check=True, timeout=60)


def test_free_memory_is_some_of_the_usable():
    assert 2**20 < _memory.free_memory() <= usable_memory()
