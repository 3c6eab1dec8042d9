"""Facts about the machine that times depend on; nothing that identifies it."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
from pathlib import Path
from typing import Any

import superfacets as sf

PACKAGES = ("numpy", "scipy", "pymetis", "pyacvd", "pyvista", "vtk", "scikit-image")


def usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def thread_counts() -> list[int]:
    """Return 1, 2 and the number of cores, ascending; 1 alone if there is one core."""
    cores = usable_cores()
    return sorted({1, min(2, cores), cores})


def facts() -> dict[str, Any]:
    """Return platform, processor, cores, load, memory, compiler and versions.

    ``load`` is the average number of processes that wanted a core in the last minute. A load above
    0 before a benchmark comes from other processes.
    """
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "cores": usable_cores(),
        "load": _load(),
        "memory_gib": _memory_gib(),
        "c_library": " ".join(platform.libc_ver()).strip(),
        "compiler": _compiler(),
        "python": platform.python_version(),
        "versions": {"superfacets": sf.__version__} | _versions(),
        "threads_in_environment": os.environ.get("SUPERFACETS_NUM_THREADS"),
    }


def _processor() -> str:
    """Return the model name of the processor, or the name that the platform gives."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        fields = dict(re.findall(r"^([\w ]+?)\s*: (.*)$", cpuinfo.read_text(), re.MULTILINE))
        if "model name" in fields:
            numbers = f"family {fields.get('cpu family')}, model {fields.get('model')}"
            return f"{fields['model name']} ({numbers})"
    return platform.processor() or "unknown"


def _load() -> float | None:
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _memory_gib() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, ValueError, OSError):
        return None  # not a POSIX system


def _compiler() -> str | None:
    """Return the version that the compiler wrote into the core; None if there is none."""
    from superfacets import _core

    found = re.search(rb"GCC: \([^)\0]*\) [\d.]+|clang version [\d.]+", _read(_core.__file__))
    return found[0].decode() if found else None


def _read(path: str) -> bytes:
    return Path(path).read_bytes()


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
