"""Meshes from files and from standard input."""

import io
import subprocess
import sys

import numpy as np
import pytest
import shapes
from command_line import COMMAND

from superfacets import Mesh, MeshError, kit, read_labels, read_mesh, segment, write_mesh
from superfacets.kit import CellFile
from superfacets_cli.inputs import read_input


@pytest.fixture
def give(monkeypatch):
    """Return a function that puts bytes on standard input."""

    def give(data):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))

    return give


def contents(tmp_path):
    """Return a small mesh in each format, keyed by ending."""
    sheet = shapes.bumpy_sheet(3)
    mesh = Mesh(np.float32(sheet.vertices), sheet.faces)  # exact in a binary STL file

    def written(ending, **options):
        write_mesh(tmp_path / f"a{ending}", mesh, **options)
        return (tmp_path / f"a{ending}").read_bytes()

    off = written(".off")
    return [
        (".ply", written(".ply")), (".off", b"# made\n" + off),
        (".off", off.replace(b"OFF\n", b"OFF", 1)),
        (".obj", b"\n# made\n # by hand\nmtllib a.mtl\n" + written(".obj")),
        (".stl", b"solid not text".ljust(80) + written(".stl")[80:]),
        (".stl", written(".stl", ascii=True)),
    ]  # fmt: skip


def test_the_format_of_standard_input_is_recognized_by_its_content(give, tmp_path):
    for ending, data in contents(tmp_path):
        assert CellFile.of_stream(data, "-").ending == ending
        give(data)
        assert read_input("-").cells().n_faces == 18, ending
        give(data)
        assert read_input("-", ending[1:]).cells().n_faces == 18, ending
    assert CellFile.of_stream(b"glTF\2\0\0\0", "-").ending == ".glb"
    assert CellFile.of_stream(b' \n{"asset": {}}', "-").ending == ".gltf"


@pytest.mark.parametrize(
    "data", [b"hello\n", b"\x89PNG\r\n\x1a\n", b"# only a comment\n", b"\n \n"]
)
def test_what_is_no_mesh_is_not_recognized(give, run, data):
    assert CellFile.of_stream(data, "-") is None
    give(data)
    status, out, err = run("segment", "-")
    assert (status, out) == (1, "")
    assert "the format of standard input is unknown: give it with --format" in err


def test_messages_name_standard_input(give):
    give(b"")
    with pytest.raises(MeshError, match=r"^standard input is empty$"):
        read_input("-").cells()
    give(b"OFF\n3 1 0\n")
    with pytest.raises(MeshError, match=r"^standard input: the header declares 3 vertices"):
        read_input("-").cells()


def test_gltf_on_standard_input_reaches_no_files():
    document = b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin", "byteLength": 1}]}'
    with pytest.raises(MeshError, match=r"^the buffer 'a\.bin' is not in the folder of the glTF"):
        kit.GltfScene.open(document, None).read()


def test_a_format_overrides_the_ending(run, tmp_path):
    path = tmp_path / "mesh.dat"
    path.write_bytes(dict(contents(tmp_path))[".obj"])
    assert run("info", path)[0] == 1
    status, out, _ = run("info", path, "--format", "obj")
    assert status == 0
    assert "faces                18" in out


def test_a_format_also_selects_how_labels_are_read(run, sheet, tmp_path):
    mesh = read_mesh(sheet)
    labels = np.arange(mesh.n_faces) // 100
    write_mesh(tmp_path / "mesh.ply", mesh, labels)
    path = (tmp_path / "mesh.ply").rename(tmp_path / "mesh.dat")
    status, _, _ = run("convert", path, "--format", "ply", "-o", tmp_path / "labels.npy")
    assert status == 0
    assert np.array_equal(read_labels(tmp_path / "labels.npy"), labels)


def test_a_pipe_goes_through(sheet):
    """Messages are printed on stderr, because the file is written to standard output."""
    command = [*COMMAND, "segment", "-", "-n", "20"]
    data = sheet.read_bytes()
    expected = segment(read_mesh(sheet), 20).labels
    piped = subprocess.run(command, input=data, capture_output=True, check=True)
    output = sheet.with_name("piped.ply")
    output.write_bytes(piped.stdout)
    assert np.array_equal(read_labels(output), expected)
    assert piped.stderr.startswith(b"standard input: 20 regions of 1,152 faces")
    again = [*command, "--to", "npy", "--json"]
    piped = subprocess.run(again, input=data, capture_output=True, check=True)
    assert np.array_equal(np.load(io.BytesIO(piped.stdout)), expected)
    assert piped.stderr.startswith(b'{"file": "-", "n_faces": 1152')
    quiet = subprocess.run([*again[:-1], "-q"], input=data, capture_output=True, check=True)
    assert (quiet.stdout, quiet.stderr) == (piped.stdout, b"")


def test_a_reader_that_goes_away_ends_the_run_without_a_word(sheet):
    command = [*COMMAND, "segment", str(sheet), "-n", "20", "-o", "-"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        message = process.stderr.read()
    assert process.returncode == 1
    assert message == b""


@pytest.mark.parametrize(
    "command",
    [("cut", "-o", "a.ply"), ("levels", "-n", "9,4", "-o", "a.npz"), ("view", "--html", "a.html")],
)
def test_labels_are_the_second_argument_and_labels_with_an_option_the_same(run, sheet, command):
    name, *options, last = command
    labels, output = sheet.with_name("labels.npy"), sheet.with_name(last)
    run("segment", sheet, "-n", 20, "-o", labels)
    written = []
    for given in ((labels,), ("--labels", labels)):
        assert run(name, sheet, *given, *options, output)[0] == 0
        written.append(output.read_bytes())
    assert written[0] == written[1]
    status, _, err = run(name, sheet, labels, "--labels", labels, *options, output)
    assert (status, "labels are given twice: as LABELS and with --labels" in err) == (2, True)
