"""Call a reader of another library in a process of its own, with limits of memory and time.

A damaged file can end the process of such a reader, stall it, or make it allocate all memory.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO

import numpy as np

from ..base.errors import MeshError, reason_of
from ..base.lazy import load
from ..base.text import shortened
from ..base.types import Array
from .guards import Content

SECONDS, BYTES_PER_SECOND = 10, 1 << 20
"""Maximum time of a call: a constant, plus the size of the file divided by a speed."""

MEMORY, MEMORY_PER_BYTE = 2 << 30, 100
"""Maximum growth of the address space: a constant, plus a multiple of the size of the file."""

Result = Mapping[str, "Array | str"]
"""Named arrays and texts."""

_REFUSED = 3
"""Exit status of the process if the file was refused; the last line of stderr has the reason."""

_MAX_SAID = 1000  # maximum size of the reason in bytes

_CODE = "from superfacets.files.guarded import main; main()"


def guarded(reader: str, data: Content, ending: str) -> dict[str, Array | str]:
    """Return the result of a function that reads a file, called in a process of its own.

    Readers of formats call `guarded`. `reader` names the function, ``"package.module:function"``,
    which takes the content and the ending of a file, and returns named arrays and texts. Raises a
    MeshError if the function raises an error, ends its process, or needs more time or memory than
    the size of the file allows. On Windows, memory is not limited.
    """
    options = [reader, ending, str(len(data))]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    new = tempfile.TemporaryFile
    with new() as given, new() as found, new() as said:
        given.write(data)
        given.seek(0)
        try:
            done = subprocess.run(
                [sys.executable, "-c", _CODE, *options], stdin=given, stdout=found, stderr=said,
                env=environment, check=False, timeout=SECONDS + len(data) / BYTES_PER_SECOND,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise MeshError("reading takes too long: the file may be damaged") from None
        if done.returncode == _REFUSED:  # the library may have printed very much before
            said.seek(-min(said.seek(0, os.SEEK_END), _MAX_SAID), os.SEEK_END)
            raise MeshError(said.read().decode("utf-8", "replace").strip().splitlines()[-1])
        if done.returncode or not found.seek(0, os.SEEK_END):
            raise MeshError("the reader of this format crashed: the file is damaged")
        found.seek(0)
        texts, names = json.loads(found.readline())
        return {**texts, **{name: np.load(found, allow_pickle=False) for name in names}}


def main() -> None:
    """Read a file from standard input, and write the result to standard output."""
    reader, ending, n_bytes = sys.argv[1:]
    _limit_memory(MEMORY + MEMORY_PER_BYTE * int(n_bytes))
    data = sys.stdin.buffer.read()
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)  # libraries print to standard output
        try:
            _send(output, load(reader)(data, ending))
        except MemoryError:
            _refuse("reading takes too much memory: the file may be damaged")
        except BaseException as error:  # libraries raise errors of many classes, and SystemExit
            damaged = f"it may be truncated or damaged: {reason_of(error)}"
            _refuse(str(error) if isinstance(error, MeshError) else damaged)


def _refuse(message: str) -> None:
    sys.stderr.write(f"\n{shortened(message)}\n")
    sys.stderr.flush()
    os._exit(_REFUSED)  # other threads and destructors of libraries cannot change the status


def _limit_memory(n_bytes: int) -> None:
    """Let this process use `n_bytes` more of its address space than now."""
    with suppress(ImportError, ValueError, OSError):  # not available, or already lower
        import resource

        with suppress(OSError):  # Linux only: address space in use, large under memory checkers
            pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
            n_bytes += int(pages) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (n_bytes, n_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _send(output: IO[bytes], result: Result) -> None:
    texts = {name: value for name, value in result.items() if isinstance(value, str)}
    arrays = {name: value for name, value in result.items() if not isinstance(value, str)}
    output.write(json.dumps([texts, [*arrays]]).encode() + b"\n")
    for array in arrays.values():
        np.save(output, np.ascontiguousarray(array), allow_pickle=False)
