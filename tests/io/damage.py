"""Read randomly damaged files in a separate process, which may crash or hang.

A test runs this program. Arguments: seed, and number of damaged files per format. Prints files that
are neither read nor refused.
"""

import random
import re
import sys
import tempfile
import warnings
from pathlib import Path

import mesh_files

from superfacets import Mesh, MeshError
from superfacets.files.formats import FORMATS
from superfacets.files.readers.labels import read_labels
from superfacets.files.readers.read import read_mesh
from superfacets.files.writers.write import write_labels, write_mesh

HUGE = (2**31 - 1, 2**31, 2**32 - 1, 10**8, 10**10, 2**63 - 1, 2**64 - 1, -1, 0)
"""Counts and offsets that are too large for a small file."""

MAX_SEARCHED = 100_000
"""Maximum number of bytes of a text in which numbers and names are looked up."""

WORDS = (b"-1", b"nan", b"1e999", b"\n", b" ", b"\0", b"\xff" * 4, b"/", *(b"%d" % n for n in HUGE))


def damaged(data: bytes, source: random.Random) -> bytes:
    """Return the file with one, two or five random changes."""
    content = bytearray(data)
    for _ in range(source.choice((1, 1, 2, 5))):
        source.choice((_change_bytes, _change_bytes, _change_count, _change_text))(content, source)
        content = content or bytearray(b"x")
    return bytes(content)


def _change_bytes(content: bytearray, source: random.Random) -> None:
    """Replace, remove or repeat some bytes, or replace them by one of `WORDS`."""
    place = source.randrange(len(content) + 1)
    width = source.choice((1, 1, 1, 4, 20))
    kind = source.randrange(4)
    if kind == 0:
        content[place : place + width] = source.randbytes(width)
    elif kind == 1:
        del content[place : place + width]
    elif kind == 2:
        content[place:place] = content[place : place + width]
    else:
        content[place : place + width] = source.choice(WORDS)


def _change_count(content: bytearray, source: random.Random) -> None:
    """Write a huge number of 2, 4 or 8 bytes, often near the beginning, where headers are."""
    width = source.choice((2, 4, 4, 8))
    place = source.randrange(len(content) if source.random() < 0.5 else min(len(content), 400))
    place -= place % 2 if source.random() < 0.5 else 0
    number = source.choice(HUGE) % (1 << 8 * width)
    content[place : place + width] = number.to_bytes(width, source.choice(("little", "big")))


def _change_text(content: bytearray, source: random.Random) -> None:
    """Replace a number in a text, the value of an XML attribute, or the name of an XML tag."""
    pattern = source.choice((rb"(-?[0-9]+)", rb"[a-zA-Z]=\"([^\"]*)\"", rb"<(/?[a-zA-Z]+)"))
    place = source.randrange(max(len(content) - MAX_SEARCHED, 1))
    found = list(re.compile(pattern).finditer(content, place, place + MAX_SEARCHED))
    if found:
        begin, end = source.choice(found).span(1)
        others = [match[1] for match in found]
        content[begin:end] = source.choice((source.choice(WORDS), source.choice(others), b""))


def whole_label_files(folder: Path) -> dict[str, bytes]:
    for ending in (".npy", ".seg"):
        write_labels(folder / f"whole{ending}", [3, 1, 2])
    for name, ascii in (("binary.ply", False), ("ascii.ply", True)):
        mesh = (mesh_files.VERTICES, mesh_files.FACES)
        write_mesh(folder / name, mesh, [3, 1], colors=[[1, 2, 3]] * 2, ascii=ascii)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def check(read, path: Path, data: bytes) -> bool:
    """Return whether the file was read; errors other than MeshError are not caught."""
    path.write_bytes(data)
    try:
        result = read(path)
    except MeshError as error:
        text = str(error)
        if not text.startswith(f"{path}: ") or len(text) > len(str(path)) + 400 or "\n" in text:
            raise AssertionError(f"bad message: {text!r}") from None
        return False
    if isinstance(result, Mesh):
        Mesh(result.vertices, result.faces)
    return True


def main() -> None:
    source = random.Random(int(sys.argv[1]))
    n_cases = int(sys.argv[2])
    warnings.simplefilter("error")
    n_read = n_refused = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [(read_labels, *item) for item in whole_label_files(folder).items()]
        files += [(read_mesh, *item) for item in mesh_files.whole_files().items()]
        for read, file_name, data in files:
            path = folder / f"damaged{Path(file_name).suffix}"
            assert read is read_mesh or path.suffix in FORMATS.labels
            assert check(read, path, data)
            for case in range(n_cases):
                broken = damaged(data, source)
                try:
                    was_read = check(read, path, broken)
                except BaseException:
                    print(f"{read.__name__} of {file_name}, case {case}: {broken!r}", flush=True)
                    raise
                n_read += was_read
                n_refused += not was_read
    print(n_read, n_refused)


if __name__ == "__main__":
    main()
