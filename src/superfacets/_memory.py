"""How much memory there is."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

__all__ = ["address_limit", "memory_of_process", "usable_memory"]

_OWN_GROUPS = Path("/proc/self/cgroup")
_GROUPS = Path("/sys/fs/cgroup")
"""Where Linux tells which groups a process is in, and what these may use."""

_IF_UNKNOWN = 4 << 30
"""Bytes of a machine that does not tell."""


def usable_memory() -> int:
    """Bytes that this process and others may use together: of the machine, container or group."""
    return min([_machine_memory(), *_group_limits()])


def memory_of_process() -> int:
    """Bytes that this process may use: of these, or as far as its address space is limited."""
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
    """What the groups of this process, and those around them, may use, if not all."""
    limits = []
    with contextlib.suppress(OSError, ValueError):  # not there, or of another form
        for line in _OWN_GROUPS.read_text().splitlines():
            _, kinds, name = line.split(":", 2)
            if not kinds:
                limits += _limits_above(_GROUPS, name, "memory.max")
            elif "memory" in kinds.split(","):
                limits += _limits_above(_GROUPS / "memory", name, "memory.limit_in_bytes")
    return limits


def _limits_above(root: Path, name: str, file: str) -> list[int]:
    """The limits of a group, of those that it is in, and of the root, which a container sees."""
    group = root / name.lstrip("/")
    limits = []
    for folder in (group, *group.parents):
        if folder == root.parent:
            break
        with contextlib.suppress(OSError, ValueError):  # not there, or "max"
            limits.append(int((folder / file).read_text()))
    return limits


def address_limit() -> int | None:
    """Bytes that this process may have mapped; None for all."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit
