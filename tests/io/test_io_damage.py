"""Truncated and damaged files are refused, or their undamaged part is read; nothing crashes."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mesh_files import whole_files

from superfacets import MeshError
from superfacets.files.readers.read import read_attributes, read_mesh

FILES = whole_files()


@pytest.mark.parametrize("name", FILES)
def test_a_file_cut_at_any_byte_is_refused_or_complete(read, tmp_path, name):
    whole = read(name, FILES[name])
    n_read = 0
    for size in range(len(FILES[name])):
        (tmp_path / name).write_bytes(FILES[name][:size])
        try:
            mesh = read_mesh(tmp_path / name)
        except MeshError:
            continue
        n_read += 1
        is_noted = "the file may be truncated" in "".join(read_attributes(tmp_path / name).left_out)
        n_faces = mesh.n_faces if name.endswith(".obj") or is_noted else whole.n_faces
        assert np.array_equal(mesh.faces, whole.faces[:n_faces])
        assert np.array_equal(mesh.vertices, whole.vertices[: 3 * n_faces if is_noted else None])
    # A text is complete without its last newline, or without the name after `endsolid`. An OBJ
    # file declares no counts, so it is valid if it is cut after its first face.
    assert n_read == {
        "ascii.ply": 1, "square.obj": 3, "square.off": 1,
        "ascii.stl": 14,  # or after a facet
    }.get(name, 0)  # fmt: skip


def test_randomly_damaged_files_are_read_or_refused():
    script = Path(__file__).with_name("damage.py")
    command = [sys.executable, "-X", "faulthandler", str(script), "7", "60"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    n_read, n_refused = (int(number) for number in done.stdout.split())
    assert n_read + n_refused == (4 + len(FILES)) * 60  # with files of labels
    assert n_refused > n_read


READ_CRASHES = """
import contextlib, sys, time
from superfacets import MeshError
from superfacets.tools.cell_file import CellFile
with contextlib.suppress(ImportError):  # Windows
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
for path in sys.argv[1:]:
    began = time.monotonic()
    try:
        CellFile.read(path).cells()
        print(path, "was read")
    except MeshError as error:
        if len(str(error)) > len(path) + 400 or "\\n" in str(error):
            print(path, "has the message", error)
    if time.monotonic() - began > 10:
        print(path, "took too long")
"""
"""Files that once ended the process, took gigabytes or hours, were read although truncated, or
raised an error of another class."""


def check_that_all_are_refused(folder):
    pytest.importorskip("lazrs")
    pytest.importorskip("pye57")
    paths = sorted(map(str, folder.iterdir()))
    assert len(paths) > 5
    command = [sys.executable, "-c", READ_CRASHES, *paths]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs more")
def test_files_that_once_crashed_are_refused():
    check_that_all_are_refused(Path(__file__).with_name("crashes"))


@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs more")
def test_files_of_an_attacker_are_refused(data_dir):
    if not (data_dir / "attack").is_dir():
        pytest.skip("the data have no folder `attack`")
    check_that_all_are_refused(data_dir / "attack")
