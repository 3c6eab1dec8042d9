"""Memory limits of the process, its control groups and the machine."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

_OWN_GROUPS = Path("/proc/self/cgroup")
_GROUPS = Path("/sys/fs/cgroup")
"""File where Linux lists the control groups of a process, and folder with their limits."""

_IF_UNKNOWN = 4 << 30
"""Assumed memory in bytes if the system does not report it."""


def usable_memory() -> int:
    """Smallest memory limit in bytes of the machine and the control groups of this process."""
    return min([_machine_memory(), *_group_limits()])


def free_memory() -> int:
    """Free memory of the machine in bytes, at most `usable_memory`, which is also the fallback."""
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(line for line in lines if line.startswith("MemAvailable"))
        return min(usable_memory(), 1024 * int(free.split()[1]))
    return usable_memory()


def memory_of_process() -> int:
    """Memory limit of this process in bytes: `usable_memory`, or a smaller address space."""
    limit = address_limit()
    return usable_memory() if limit is None else min(usable_memory(), limit)


def _machine_memory() -> int:
    if sys.platform == "win32":
        import ctypes

        kilobytes = ctypes.c_ulonglong()
        told = ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
        return kilobytes.value << 10 if told else _IF_UNKNOWN
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _group_limits() -> list[int]:
    """Limits of the control groups of this process and of their parents, in bytes."""
    limits = []
    with contextlib.suppress(OSError, ValueError):  # no such file, or another format
        for line in _OWN_GROUPS.read_text().splitlines():
            _, kinds, name = line.split(":", 2)
            if not kinds:
                limits += _limits_above(_GROUPS, name, "memory.max")
            elif "memory" in kinds.split(","):
                limits += _limits_above(_GROUPS / "memory", name, "memory.limit_in_bytes")
    return limits


def _limits_above(root: Path, name: str, file: str) -> list[int]:
    """Limits of a group, its parents and the root group, in bytes; a container sees the root."""
    group = root / name.lstrip("/")
    limits = []
    for folder in (group, *group.parents):
        if folder == root.parent:
            break
        with contextlib.suppress(OSError, ValueError):  # no such file, or "max"
            limits.append(int((folder / file).read_text()))
    return limits


def address_limit() -> int | None:
    """Size limit of the address space of this process in bytes; None without a limit."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit
