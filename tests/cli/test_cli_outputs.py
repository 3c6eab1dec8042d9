"""Output paths, and ambiguous command lines."""

import shlex
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest
import shapes
from command_line import COMMAND, files_in

from superfacets import read_labels, write_mesh
from superfacets_cli.outputs import plan_jobs


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the current folder, which contains three PLY files and an OFF file."""
    for name in ("a.ply", "b.ply", "c.ply"):
        write_mesh(tmp_path / name, shapes.bumpy_sheet(4))
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def plan(inputs, outputs=(), formats=(), *, ascii=False):
    with click.Context(click.Command("segment")):
        jobs = plan_jobs(inputs, {"outputs": outputs, "formats": formats, "ascii": ascii})
    return [(job.input, [str(path) for path in job.files], job.stream) for job in jobs]


def test_results_lie_beside_the_inputs_in_a_folder_or_in_named_files(folder):
    assert plan(["a.ply", "sub/b.ply"]) == [
        ("a.ply", ["a.superfacets.ply"], None),
        ("sub/b.ply", [str(Path("sub", "b.superfacets.ply"))], None),
    ]
    assert plan(["a.ply", "b.ply"], ["new/x/"], ["npy", "seg"]) == [
        ("a.ply", [str(Path("new/x", f"a.superfacets.{end}")) for end in ("npy", "seg")], None),
        ("b.ply", [str(Path("new/x", f"b.superfacets.{end}")) for end in ("npy", "seg")], None),
    ]
    assert not (folder / "new").exists()  # nothing was written there
    (folder / "new").mkdir()
    assert plan(["a.ply"], ["new"])[0][1] == [str(Path("new", "a.superfacets.ply"))]
    assert plan(["a.ply"], ["x.npy", "x.ply"]) == [("a.ply", ["x.npy", "x.ply"], None)]


def test_standard_input_goes_to_standard_output_unless_told_otherwise(folder):
    assert plan(["-"]) == [("-", [], ".ply")]
    assert plan(["-"], formats=["txt"]) == [("-", [], ".txt")]
    assert plan(["-"], ["x.npy"]) == [("-", ["x.npy"], None)]
    assert plan(["a.ply"], ["-", "x.npy"], ["seg"]) == [("a.ply", ["x.npy"], ".seg")]


@pytest.mark.parametrize(("arguments", "message"), [
    (["a.ply", "b.ply", "-o", "x.npy"], "x.npy is one file for 2 inputs: give -o a folder"),
    (["a.ply", "b.ply", "-o", "-"], "- is one file for 2 inputs: give -o a folder"),
    (["a.ply", "-"], "standard input (-) must be the only input"),
    (["-", "-o", "results/"], "standard input has no file name: give -o a file, not a folder"),
    (["a.ply", "a.ply"], "would both be written to a.superfacets.ply"),
    (["a.ply", "./a.ply"], "would both be written to a.superfacets.ply"),
    (["a.ply", "a.off"], "a.ply and a.off would both be written to a.superfacets.ply"),
    (["a.ply", "-o", "x.npy", "-o", "./x.npy"], "x.npy: the same output is given twice"),
    (["a.ply", "-o", "b/", "-o", "c/"], "give -o at most one folder"),
    (["a.ply", "-o", "results"], "got none (for a folder, write results/)"),
    (["a.ply", "-o", "b.gltf"],
     "expected the ending .ply, .vtp, .obj, .off, .glb, .ids.png, .stl, .vtu, .vtk, .csv, .pcd,"
     " .las, .laz, .npy, .seg, .txt, .segs.json, .bin, _sp_label.npy, .pth, .label.gii, .annot,"
     " .sstk.json, .aggregation.json, .npz, got .gltf (see"),
    (["a.ply", "-o", "new.gltf"], ".aggregation.json, .npz, got .gltf (see"),
    (["a.ply", "-o", ""], "got none"),
    (["a.ply", "-o", "x.npy", "--to", "npy"],
     "--to has no effect: the endings of the output files"),
    (["-", "--to", "npy", "--to", "txt"], "standard output can have one format only"),
    (["a.ply", "--to", "npy", "--to", "npy"], "npy: the same output is given twice"),
    (["a.ply", "--to", "npy,npy"], "npy: the same output is given twice"),
    (["a.ply", "--to", "npy,tri"], "'--to': 'tri' is not one of 'ply', 'vtp',"),
    (["a.ply", "--format", "docx"], "Invalid value for '--format'"),
    ([], "Missing argument"),
])  # fmt: skip
def test_what_can_be_read_in_two_ways_is_refused(run, folder, arguments, message):
    before = files_in(folder)
    status, out, err = run("segment", *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert files_in(folder) == before


def test_an_output_never_replaces_an_input(run, folder):
    run("segment", "a.ply")
    status, _, err = run("segment", "b.ply", "a.ply", "a.superfacets.ply")
    assert status == 2
    assert "a.superfacets.ply: the output would overwrite the input" in err
    Path("link.npy").hardlink_to("b.ply")
    assert run("segment", "b.ply", "-o", "link.npy")[0] == 2
    assert not Path("b.superfacets.ply").exists()


def test_binary_data_is_not_shown_on_a_terminal(run, folder, terminal):
    terminal(sys.stdout)
    for arguments in (["-"], ["a.ply", "-o", "-"], ["a.ply", "-o", "-", "--to", "npy"]):
        status, _, err = run("segment", *arguments)
        assert status == 2
        assert "standard output is a terminal, which cannot show binary data" in err
    terminal(sys.stdout)
    status, out, _ = run("segment", "a.ply", "-n", 1, "-o", "-", "--to", "seg")
    assert (status, out) == (0, "0\n" * 32)
    terminal(sys.stdout)
    assert run("segment", "a.ply", "-n", 1, "-o", "-", "--ascii")[1].startswith("ply\nformat ascii")


def test_a_file_in_the_place_of_a_folder_is_one_line(run, folder):
    status, _, err = run("segment", "a.ply", "-o", "b.ply/")
    assert status == 1
    assert err == "superfacets: error: b.ply: is a file, not a folder\n"


def test_formats_are_a_list_or_given_several_times(run, folder):
    run("segment", "a.ply", "-n", 3, "-q", "-o", "results/", "--to", "npy, seg", "--to", "txt")
    assert files_in(folder / "results") == [f"a.superfacets.{end}" for end in ("npy", "seg", "txt")]


def test_files_of_all_inputs_go_to_a_folder(run, folder):
    status, out, err = run("segment", "a.ply", "b.ply", "-n", 3, "-o", "results/", "--to", "npy")
    assert (status, err) == (0, "")
    assert files_in(folder / "results") == ["a.superfacets.npy", "b.superfacets.npy"]
    assert [line.split(":")[0].split(",")[0] for line in out.splitlines()] == [
        f"wrote {Path('results/a.superfacets.npy')} (a label per face)", "a.ply",
        f"wrote {Path('results/b.superfacets.npy')} (a label per face)", "b.ply",
    ]  # fmt: skip
    assert read_labels("results/b.superfacets.npy").max() == 2


@pytest.mark.parametrize(("line", "message"), [
    ("segment - <&-", "standard input is closed"),
    ("segment {sheet} -o - --to txt >&-", "standard output is closed"),
    ("segment {sheet} -o - --to txt >/dev/full", "standard output: No space left on device"),
    ("info {sheet} >/dev/full", "standard output: No space left on device"),
])  # fmt: skip
def test_streams_that_cannot_be_used_are_one_line(sheet, line, message):
    if "/dev/full" in line and not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full here")
    command = shlex.join(COMMAND) + " " + line.format(sheet=shlex.quote(str(sheet)))
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"superfacets: error: {message}"
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "command",
    [["segment", "bad.ply", "-o", "new/x/"], ["convert", "bad.ply", "a.npy", "-o", "new/x/"]],
)
def test_a_failed_run_leaves_no_folder(run, folder, command):
    (folder / "bad.ply").write_bytes(b"junk")
    (folder / "old").mkdir()
    np.save(folder / "a.npy", np.zeros(32, int))
    assert run(*command)[0] == 1
    assert not (folder / "new").exists()
    assert run("segment", "bad.ply", "-o", "old/")[0] == 1
    assert (folder / "old").is_dir()  # was there before
    assert run("segment", "a.ply", "-n", 4, "-q", "-o", "new/x/") == (0, "", "")
    assert files_in(folder / "new" / "x") == ["a.superfacets.ply"]


def test_results_of_a_read_only_input_go_to_the_current_folder(run, folder):
    (folder / "data").mkdir()
    write_mesh(folder / "data" / "a.ply", shapes.bumpy_sheet(4))
    (folder / "data" / "a.ply").chmod(0o444)
    status, out, err = run("segment", "data/a.ply", "-n", 4)
    assert status == 0
    assert err == (
        "superfacets: note: data/a.ply is read-only: results are written to the current folder\n"
    )
    assert out.startswith("wrote a.superfacets.ply\n")
    assert files_in(folder / "data") == ["a.ply"]
    assert (folder / "a.superfacets.ply").exists()


def test_nothing_is_said_of_a_read_only_input_in_the_current_folder(run, folder):
    (folder / "a.ply").chmod(0o444)
    assert run("segment", "a.ply", "-n", 4, "-q", "--force")[::2] == (0, "")
    assert (folder / "a.superfacets.ply").exists()


def test_a_read_only_folder_is_named(run, folder):
    (folder / "data").mkdir()
    write_mesh(folder / "data" / "a.ply", shapes.bumpy_sheet(4))
    (folder / "data").chmod(0o555)
    try:
        status, _, err = run("segment", "data/a.ply", "-n", 4)
    finally:
        (folder / "data").chmod(0o755)
    assert status == 0
    assert (
        err == "superfacets: note: data is read-only: results are written to the current folder\n"
    )
