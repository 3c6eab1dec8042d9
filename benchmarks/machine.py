"""Facts about the machine that affect times. No fact identifies the machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import re
from pathlib import Path
from typing import Any

import superfacets as sf
from superfacets.base import checks as _validate

usable_cores = _validate.usable_cores

PACKAGES = ("numpy", "scipy", "pymetis", "pyacvd", "pyvista", "vtk", "scikit-image")


def thread_counts() -> list[int]:
    """Return 1, 2 and the number of cores, in ascending order and without repetitions."""
    cores = usable_cores()
    return sorted({1, min(2, cores), cores})


def facts() -> dict[str, Any]:
    """Return platform, processor, cores, load, memory, compiler and versions.

    ``load`` is the mean number of runnable processes in the last minute. Before a benchmark, the
    load is caused by other programs.
    """
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "cores": usable_cores(),
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
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


def _memory_gib() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, ValueError, OSError):
        return None  # not a POSIX system


def _compiler() -> str | None:
    """Return the compiler version in the binary of the core, or None if there is no version."""
    from superfacets import _core

    content = Path(_core.__file__).read_bytes()
    found = re.search(rb"GCC: \([^)\0]*\) [\d.]+|clang version [\d.]+", content)
    return found[0].decode() if found else None


def _versions() -> dict[str, str]:
    found = {}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
