"""Damaged work files of the studio are opened, or refused by one line that names the file."""

from __future__ import annotations

import functools
import json
import random
import tempfile
import zlib
from pathlib import Path

import damage
import numpy as np
import shapes

import superfacets as sf
from superfacets_studio.documents.document import Document, work_file_of
from superfacets_studio.documents.journal import JournalError

from .files import ODD_VALUES
from .promises import short_messages


def check_work_file(rng: np.random.Generator, folder: Path) -> None:
    """Open a work file with changed bytes, or with odd values and correct checksums."""
    source = random.Random(int(rng.integers(2**63)))
    mesh, work = _whole_work()
    path = folder / "cube.ply"
    path.write_bytes(mesh)
    change = damage.damaged if source.random() < 0.3 else _odd
    work_file_of(path).write_bytes(change(work, source))
    document = None
    with short_messages(path, JournalError, sf.MeshError):
        document = Document.open(path)
    if document is None:
        return
    document.paint(document.revision.cells_of(0), 1)
    document.close()
    Document.open(path).close()


@functools.cache
def _whole_work() -> tuple[bytes, bytes]:
    """Return the content of a mesh file, and the content of its work file."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        path = Path(folder, "cube.ply")
        sf.write_mesh(path, shapes.bumpy_sheet(4))
        document = Document.open(path, n_segments=5)
        for number in (1, 2, 3):
            document.paint(document.revision.cells_of(number), number)
        document.undo()
        document.close()
        return path.read_bytes(), work_file_of(path).read_bytes()


def _odd(work: bytes, source: random.Random) -> bytes:
    """Return a work file with correct checksums and one odd value.

    One line of the file may be missing or repeated.
    """
    lines = [json.loads(line) for line in work.splitlines()]
    number = source.randrange(len(lines))
    line = lines[number]
    line.pop("crc")
    line[source.choice(sorted(line))] = source.choice(ODD_VALUES)
    begin = source.randrange(len(lines))
    lines[begin : begin + 1] = [lines[begin]] * source.choice((0, 1, 1, 1, 2))
    return b"".join(map(_coded, lines))


def _coded(line: dict[str, object]) -> bytes:
    body = {name: value for name, value in line.items() if name != "crc"}
    text = json.dumps(body, separators=(",", ":")).encode("ascii")[:-1]
    return text + b',"crc":"%08x"}\n' % zlib.crc32(text)
