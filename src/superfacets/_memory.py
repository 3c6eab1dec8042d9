"""Determine how much memory this process may use, and how much of it is free."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

_OWN_GROUPS = Path("/proc/self/cgroup")
"""File in which Linux lists the control groups of this process."""

_GROUPS = Path("/sys/fs/cgroup")
"""Folder in which Linux stores the limits of all control groups."""

_IF_UNKNOWN = 4 << 30
"""Assumed memory of the machine, in bytes, if the system does not report it."""


def usable_memory() -> int:
    """Return the maximum memory of this process in bytes.

    It is the memory of the machine, or the lowest limit of the control groups if that is less.
    """
    return min([_machine_memory(), *_group_limits()])


def free_memory() -> int:
    """Return the free memory of the machine in bytes, but at most `usable_memory`.

    The result is `usable_memory` if the system does not report free memory. Only Linux reports it.
    """
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(line for line in lines if line.startswith("MemAvailable"))
        return min(usable_memory(), 1024 * int(free.split()[1]))
    return usable_memory()


def memory_of_process() -> int:
    """Return the smaller of `usable_memory` and `address_limit`, in bytes."""
    limit = address_limit()
    return usable_memory() if limit is None else min(usable_memory(), limit)


def _machine_memory() -> int:
    if sys.platform == "win32":
        import ctypes

        kilobytes = ctypes.c_ulonglong()
        succeeded = ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(
            ctypes.byref(kilobytes)
        )
        return kilobytes.value << 10 if succeeded else _IF_UNKNOWN
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _group_limits() -> list[int]:
    """Return the memory limits in bytes of this process's control groups and their parents."""
    limits = []
    with contextlib.suppress(OSError, ValueError):  # the file is missing or has another format
        for line in _OWN_GROUPS.read_text().splitlines():
            _, kinds, name = line.split(":", 2)
            if not kinds:
                limits += _limits_above(_GROUPS, name, "memory.max")
            elif "memory" in kinds.split(","):
                limits += _limits_above(_GROUPS / "memory", name, "memory.limit_in_bytes")
    return limits


def _limits_above(root: Path, name: str, file: str) -> list[int]:
    """Return the memory limits, in bytes, of a control group and its parents, including the root.

    The root is included because in a container, often only the root group has a limit.
    """
    group = root / name.lstrip("/")
    limits = []
    for folder in (group, *group.parents):
        if folder == root.parent:
            break
        with contextlib.suppress(OSError, ValueError):  # the file is missing or contains "max"
            limits.append(int((folder / file).read_text()))
    return limits


def address_limit() -> int | None:
    """Return the maximum size of the address space in bytes, or None if there is no maximum."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit
