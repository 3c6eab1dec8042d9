"""The command as its users see it: files, lines, exit status."""

import json
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import numpy as np
import pytest
import shapes

from superfacets import (
    PAPER,
    mesh_info,
    read_labels,
    read_mesh,
    segment,
    subdivide,
    write_mesh,
)
from superfacets.cli.main import main

STAGES = ["mesh", "face_graph", "weights", "order", "seeding", "classify", "update", "regions",
          "export"]  # fmt: skip


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command in this process; returns exit status, stdout and stderr."""

    def _run(*arguments):
        monkeypatch.setattr(sys, "argv", ["superfacets", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        return stop.value.code, *capsys.readouterr()

    return _run


@pytest.fixture
def sheet(tmp_path):
    """A file with a mesh of 1,152 faces."""
    path = tmp_path / "sheet.ply"
    write_mesh(path, shapes.bumpy_sheet(24))
    return path


def files_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_terminal_shows_progress(run, sheet, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    status, out, err = run("segment", sheet)
    assert status == 0
    assert "iteration/s" in err
    assert "iteration/s" not in out


def test_segment_writes_a_labeled_mesh_beside_the_input(run, sheet):
    status, out, err = run("segment", sheet)
    output = sheet.with_name("sheet.superfacets.ply")
    assert (status, err) == (0, "")
    assert files_in(sheet.parent) == ["sheet.ply", "sheet.superfacets.ply"]
    expected = segment(read_mesh(sheet), 150)
    assert np.array_equal(read_labels(output), expected.labels)
    assert np.array_equal(read_mesh(output).vertices, read_mesh(sheet).vertices)
    first, last = out.splitlines()
    assert first == f"wrote {output}"
    numbers = ", ".join(rf"{stage} \d+\.\d+" for stage in STAGES)
    facts = f"1152 faces, 150 regions, {expected.n_iter} iterations, {expected.stop_reason}"
    assert re.fullmatch(rf"sheet\.ply: {facts}; seconds: {numbers}", last)


def test_the_ending_of_each_output_picks_its_format(run, sheet):
    outputs = [sheet.with_name(name) for name in ("a.npy", "b.seg", "c.txt", "D.PLY")]
    arguments = [argument for path in outputs for argument in ("-o", path)]
    status, _, _ = run("segment", sheet, "-n", 20, *arguments)
    assert status == 0
    expected = segment(sheet, 20).labels
    for path in outputs:
        assert np.array_equal(read_labels(path), expected), path
    assert outputs[1].read_text() == "".join(f"{label}\n" for label in expected)
    assert np.load(outputs[0]).dtype == np.int32


def test_every_option_reaches_the_library(run, sheet, tmp_path):
    output = tmp_path / "labels.npy"
    options = [
        (["-n", 30, "-a", 50, "--eta", 1], {"n_segments": 30, "alpha": 50, "eta_convex": 1}),
        (["-r", 0.1, "--init", "grid"], {"radius": 0.1, "init": "grid"}),
        (["--init", "flood", "--max-iter", 3], {"init": "flood", "max_num_iter": 3}),
        (["-n", 30, "--tol", 0.3, "--threads", 2], {"n_segments": 30, "tol": 0.3}),
        (["-n", 30, "--weights", "stk02", "-a", 0.2],
         {"n_segments": 30, "weights": "stk02", "alpha": 0.2}),
        (["-n", 30, "--weights", "superfacets", "--init", "farthest", "--no-smooth"],
         {"n_segments": 30, "weights": "superfacets", "init": "farthest", "smooth": False}),
        (["-n", 30, "--min-size", 0.5, "--islands", "nearest"],
         {"n_segments": 30, "min_size": 0.5, "islands": "nearest"}),
        (["-n", 30, "--paper"], {"n_segments": 30, **PAPER}),
        (["-n", 30, "--paper", "--tol", 0.3], {"n_segments": 30, **PAPER, "tol": 0.3}),
        (["-n", 30, "--paper", "--smooth", "--connect"],
         {"n_segments": 30, **PAPER, "smooth": True, "enforce_connectivity": True}),
    ]  # fmt: skip
    for arguments, keywords in options:
        assert run("segment", sheet, *arguments, "-o", output)[0] == 0
        assert np.array_equal(np.load(output), segment(sheet, **keywords).labels), arguments


def test_json_is_one_object_with_the_facts(run, sheet):
    status, out, _ = run("segment", sheet, "-n", 20, "--json")
    facts = json.loads(out)
    assert status == 0
    assert (facts["n_faces"], facts["n_segments"]) == (1152, 20)
    assert set(facts["seconds"]) == set(STAGES)
    assert facts["params"]["alpha"] == 20
    assert facts["outputs"] == [str(sheet.with_name("sheet.superfacets.ply"))]


@pytest.fixture
def block(tmp_path):
    """A file with a CAD mesh of 272 faces, most of them long and thin."""
    path = tmp_path / "block.ply"
    write_mesh(path, shapes.drilled_block(64))
    return path


def test_slivers_are_a_note_of_one_line(run, block):
    status, _, err = run("segment", block, "-n", 100)
    assert status == 0
    assert err == (
        "superfacets: note: 20% of the area is in faces that are long and thin beside the regions,"
        " which become stripes: try --subdivide\n"
    )


def test_subdivide_writes_the_parts_and_labels_of_the_faces_of_the_input(run, block, tmp_path):
    labeled, listed = tmp_path / "labeled.ply", tmp_path / "labels.npy"
    arguments = ("segment", block, "-n", 100, "-o", labeled, "-o", listed, "--json")
    status, out, err = run(*arguments, "--subdivide")
    mesh = read_mesh(block)
    radius = np.sqrt(mesh_info(mesh).area / (100 * np.pi))
    parts = subdivide(mesh, 0.25 * radius)
    expected = segment(parts.mesh, 100).labels
    assert status == 0
    assert np.array_equal(read_labels(labeled), expected)
    assert np.array_equal(read_mesh(labeled).vertices, parts.mesh.vertices)
    back = parts.labels_back(expected)
    assert np.array_equal(np.load(listed), back)
    assert len(back) == mesh.n_faces
    n_lost = 100 - len(np.unique(back))
    assert n_lost > 0
    assert err == (
        f"superfacets: note: {mesh.n_faces} faces were subdivided into {parts.mesh.n_faces}\n"
        f"superfacets: note: {n_lost} regions have the most area in no face of the input:"
        " label files lack them\n"
    )
    facts = json.loads(out)
    assert facts["sliver_share"] == 0
    assert facts["n_faces"] == parts.mesh.n_faces
    assert "subdivide" in facts["seconds"]


def test_subdivide_heeds_a_radius_or_a_longest_edge(run, block, tmp_path):
    output = tmp_path / "labeled.ply"
    mesh = read_mesh(block)
    diagonal = mesh_info(mesh).diagonal
    cases = [
        (["--subdivide", "-r", 0.1], 0.25 * 0.1 * diagonal),
        (["--max-edge", 0.2], 0.2),
        (["--subdivide", "--max-edge", 0.2, "-n", 300], 0.2),
    ]
    for arguments, max_edge in cases:
        status, _, err = run("segment", block, *arguments, "-o", output)
        assert status == 0
        assert "label files" not in err
        assert np.array_equal(read_mesh(output).faces, subdivide(mesh, max_edge).mesh.faces)


def test_a_longest_edge_that_makes_too_many_faces_is_refused(run, block):
    status, _, err = run("segment", block, "--max-edge", 1e-5)
    assert status == 2
    assert err.startswith("superfacets: error: max_edge=1e-05 would make more than 10000000 faces")


def test_more_regions_than_asked_for_are_explained(run, tmp_path):
    path = tmp_path / "islands.ply"
    write_mesh(path, shapes.two_islands())
    status, out, err = run("segment", path, "-n", 1)
    assert status == 0
    assert "2 regions" in out
    assert err == (
        "superfacets: note: 1 more regions than asked for,"
        " for components of the mesh that got no seed\n"
    )
    assert "no center reached" in run("segment", path, "-n", 1, "--paper")[2]
    assert run("segment", path, "-n", 2)[2] == ""


def test_ascii_writes_text(run, sheet):
    run("segment", sheet, "-n", 5, "--ascii")
    text = sheet.with_name("sheet.superfacets.ply").read_text("ascii")
    assert "format ascii 1.0" in text
    assert "property int label" in text


def test_info_prints_counts(run, sheet):
    status, out, err = run("info", sheet)
    assert (status, err) == (0, "")
    rows = dict(re.split(r" {2,}", line, maxsplit=1) for line in out.splitlines())
    assert rows["faces"] == "1152"
    assert rows["boundary edges"] == "96"
    assert rows["inside out"] == "no"
    facts = json.loads(run("info", sheet, "--json")[1])
    assert facts["n_faces"] == 1152
    assert facts["n_boundary_edges"] == 96


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-n", 0], "Invalid value for '-n' / '--n-segments': 0 is not in the range x>=1."),
        (["-n", "many"], "Invalid value for '-n'"),
        (["-n", 1153], "n_segments is 1153 but there are only 1152 faces"),
        (["-n", 5, "-r", 0.1], "give n_segments or radius, not both"),
        (["-r", 0], "Invalid value for '-r' / '--radius'"),
        (["-r", "nan"], "radius must be finite and positive"),
        (["-a", -1], "Invalid value for '-a' / '--alpha': -1.0 is not in the range x>=0."),
        (["-a", "inf"], "alpha must be finite and not negative"),
        (["--eta", -1], "Invalid value for '--eta'"),
        (["--init", "random"], "Invalid value for '--init'"),
        (["--max-iter", 0], "Invalid value for '--max-iter'"),
        (["--tol", -1], "Invalid value for '--tol'"),
        (["--threads", 0], "Invalid value for '--threads'"),
        (["--smoother"], "No such option"),
        (["--paper", "--weights", "stk02"], "--paper has weights of its own: leave --weights out"),
        (["--paper", "--init", "grid"], "--paper has init of its own: leave --init out"),
        (["-o", "labels.xyz"], "labels.xyz"),
    ],
)
def test_wrong_options_are_one_line_and_status_2(run, sheet, arguments, message):
    status, out, err = run("segment", sheet, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("superfacets: error: ")
    assert message in err
    assert err.count("\n") == 1
    assert files_in(sheet.parent) == ["sheet.ply"]


def test_data_that_cannot_be_used_is_one_line_and_status_1(run, tmp_path):
    (tmp_path / "empty.ply").write_bytes(b"")
    (tmp_path / "foreign.obj").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0")
    (tmp_path / "points.off").write_text("OFF\n2 0 0\n0 0 0\n1 0 0\n")
    (tmp_path / "quad.off").write_text("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    (tmp_path / "nan.off").write_text("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n")
    (tmp_path / "index.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")
    (tmp_path / "mesh.docx").write_text("")
    (tmp_path / "folder.ply").mkdir()
    before = files_in(tmp_path)
    for name in [*before, "missing.ply"]:
        for command in ("segment", "info"):
            status, out, err = run(command, tmp_path / name)
            assert (status, out) == (1, ""), name
            assert err.startswith("superfacets: error: "), name
            assert err.count("\n") == 1, name
            assert name in err, name
    assert files_in(tmp_path) == before


def test_strips_and_polygons_are_refused_by_name(run, data_dir, tmp_path):
    output = tmp_path / "labels.npy"
    for name, word in [("igea_tristrips.ply", "strips"), ("beast.obj", "triangles")]:
        status, _, err = run("segment", data_dir / "meshes" / name, "-o", output)
        assert status == 1
        assert word in err
        assert err.count("\n") == 1
    assert not output.exists()


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_a_folder_in_the_place_of_a_mesh_is_one_line(run, name):
    status, _, err = run("segment", name)
    assert status in (1, 2)
    assert err.startswith("superfacets: error: ")
    assert err.count("\n") == 1


def test_settings_in_the_environment_are_checked(run, sheet, monkeypatch):
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "abc")
    status, _, err = run("info", sheet)
    assert (status, err.count("\n")) == (2, 1)
    assert "SUPERFACETS_NUM_THREADS is 'abc'" in err
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "99999999999")
    assert run("info", sheet)[0] == 0


def test_labels_in_a_mesh_file_that_are_wrong_are_not_passed_over(run, tmp_path):
    path = tmp_path / "mesh.ply"
    write_mesh(path, shapes.strip(2), [0, 1], ascii=True)
    *head, last = path.read_text().splitlines()
    count, a, b, c, label, *rest = last.split()
    assert label == "1"
    path.write_text("\n".join([*head, " ".join([count, a, b, c, "-4", *rest]), ""]))
    status, _, err = run("render", path, "-o", tmp_path / "picture.png")
    assert status == 1
    assert "labels[1] is -4" in err


def test_the_demo_makes_nothing_where_it_cannot_draw(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkCommonCore", None)
    status, out, err = run("demo", "-o", tmp_path / "demo")
    assert (status, out) == (1, "")
    assert "pip install 'superfacets[viz]'" in err
    assert files_in(tmp_path) == []


def test_an_output_that_cannot_be_written_is_found_before_the_work(run, sheet, tmp_path):
    status, _, err = run("segment", sheet, "-o", tmp_path / "nowhere" / "labels.npy")
    assert status == 1
    assert "nowhere" in err
    assert err.count("\n") == 1
    (tmp_path / "taken.npy").mkdir()
    status, _, err = run("segment", sheet, "-o", tmp_path / "ok.npy", "-o", tmp_path / "taken.npy")
    assert status == 1
    assert "taken.npy" in err
    assert files_in(tmp_path) == ["sheet.ply", "taken.npy"]


def test_the_input_is_never_overwritten(run, sheet):
    before = sheet.read_bytes()
    status, _, err = run("segment", sheet, "-o", sheet)
    assert status == 2
    assert "the output would take the place of the input" in err
    assert sheet.read_bytes() == before


def test_a_failed_run_leaves_what_was_there(run, sheet, tmp_path):
    kept = tmp_path / "labels.npy"
    kept.write_bytes(b"precious")
    assert run("segment", sheet, "-n", 5000, "-o", kept)[0] == 2
    assert kept.read_bytes() == b"precious"
    assert files_in(tmp_path) == ["labels.npy", "sheet.ply"]


def test_help_and_version_are_printed(run):
    assert run("--version")[1].startswith("superfacets 0.")
    status, out, _ = run("--help")
    assert status == 0
    assert {"segment", "info", "render", "demo"} <= set(out.split())
    assert "--n-segments" in run("segment", "-h")[1]


def test_without_a_command_the_help_is_shown(run):
    status, out, err = run()
    assert (status, out) == (2, "")
    assert err.startswith("Usage: ")
    assert "segment" in err


def test_rendering_wants_a_png(run, sheet, tmp_path):
    status, _, err = run("render", sheet, "-o", tmp_path / "picture.jpg")
    assert status == 2
    assert "picture.jpg: pictures are written as .png" in err


def test_labels_of_another_mesh_are_refused(run, sheet, tmp_path):
    labels = tmp_path / "labels.npy"
    np.save(labels, np.zeros(7, np.int32))
    status, _, err = run("render", sheet, "--labels", labels, "-o", tmp_path / "picture.png")
    assert status == 1
    assert "7" in err
    assert "1152" in err
    assert not (tmp_path / "picture.png").exists()


def test_a_mesh_is_drawn_with_its_labels(run, sheet, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    plain, labeled, given = (tmp_path / f"{name}.png" for name in ("plain", "labeled", "given"))
    both = ["-o", tmp_path / "l.ply", "-o", tmp_path / "l.npy"]
    assert run("segment", sheet, "-n", 20, *both)[0] == 0
    assert run("render", sheet, "-o", plain)[:2] == (0, f"wrote {plain}\n")
    assert run("render", tmp_path / "l.ply", "-o", labeled)[0] == 0
    assert run("render", sheet, "--labels", tmp_path / "l.npy", "-o", given)[0] == 0
    assert labeled.read_bytes() == given.read_bytes() != plain.read_bytes()
    turned = tmp_path / "turned.png"
    view = ["--up", "z", "--azimuth", "-40", "--elevation", "50"]
    assert run("render", tmp_path / "l.ply", "-o", turned, *view)[0] == 0
    assert turned.read_bytes() != labeled.read_bytes()


def test_the_demo_makes_a_labeled_mesh_and_a_picture(run, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    folder = tmp_path / "new" / "demo"
    status, out, _ = run("demo", "-o", folder)
    assert status == 0
    assert files_in(folder) == ["bear.superfacets.ply", "bear.superfacets.png"]
    assert all(str(folder / name) in out for name in files_in(folder))
    assert read_labels(folder / "bear.superfacets.ply").max() == 149


def can_render():
    from superfacets.view.gl import RenderError, ensure_gl

    pytest.importorskip("vtkmodules")
    try:
        ensure_gl()
    except RenderError:
        return False
    return True


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """A file that takes seconds to segment with the paper's stop rule."""
    from superfacets import Mesh, sample_mesh

    bear = sample_mesh()
    places = [[3.0 * place, 0.0, 0.0] for place in range(17)]
    vertices = np.concatenate([bear.vertices + place for place in places])
    faces = np.concatenate([bear.faces + n * bear.n_vertices for n in range(len(places))])
    path = tmp_path_factory.mktemp("large") / "bear.ply"
    write_mesh(path, Mesh(vertices, faces))
    return path


COMMAND = [sys.executable, "-c", "from superfacets.cli.main import main; main()"]


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_the_run_within_an_iteration_and_leaves_nothing(large, sent):
    command = [*COMMAND, "segment", large, "-n", "150", "--paper", "--max-iter", "100000"]
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    with subprocess.Popen(command, stderr=theirs, stdout=subprocess.PIPE) as process:
        shown = b""
        while b"iteration" not in shown:  # the bar: the loop has begun
            shown += os.read(ours, 10_000)
        start = time.perf_counter()
        process.send_signal(sent)
        process.communicate(timeout=60)
    os.set_blocking(ours, False)
    shown += os.read(ours, 100_000)
    os.close(theirs)
    os.close(ours)
    assert time.perf_counter() - start < 10
    assert process.returncode == 130
    assert shown.endswith(b"superfacets: error: interrupted\r\n")
    assert files_in(large.parent) == ["bear.ply"]


def test_a_pipe_shows_no_progress_bar_and_a_terminal_does(large, tmp_path):
    command = [*COMMAND, "segment", str(large), "-o", str(tmp_path / "labels.npy")]
    piped = subprocess.run(command, capture_output=True, text=True, check=True)
    assert piped.stderr == ""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=theirs, timeout=60)
    os.set_blocking(ours, False)  # whatever was shown is there by now
    shown = os.read(ours, 100_000).decode()
    os.close(theirs)
    os.close(ours)
    assert "iteration" in shown


def test_the_package_can_be_run_as_a_module(sheet):
    command = [sys.executable, "-m", "superfacets", "info", str(sheet)]
    assert "1152" in subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_command_is_installed():
    assert shutil.which("superfacets", path=Path(sys.executable).parent)


def test_the_bunny_takes_less_than_two_seconds_of_processors_as_a_whole_process(data_dir, tmp_path):
    """Several times what it needs, and not by the clock: others may be at work."""
    bunny = data_dir / "meshes" / "bunny.ply"
    command = [*COMMAND, "segment", str(bunny), "-o", str(tmp_path / "bunny.ply")]
    before = os.times()
    subprocess.run(command, check=True, capture_output=True)
    after = os.times()
    spent = after.children_user + after.children_system
    assert spent - before.children_user - before.children_system < 2.0


@pytest.fixture
def labeled_strip(tmp_path):
    """A strip of four faces, its labels and two ground truths."""
    write_mesh(tmp_path / "strip.ply", shapes.strip(4))
    for name, labels in [("labels", "0011"), ("one", "0011"), ("two", "0111")]:
        (tmp_path / f"{name}.seg").write_text("\n".join(labels) + "\n")
    return tmp_path


def test_evaluate_prints_metrics_with_and_without_ground_truth(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    status, printed, _ = run("evaluate", mesh, labels)
    assert status == 0
    assert [line.split() for line in printed.splitlines()] == [
        ["n_regions", "2"], ["n_extra_pieces", "0"], ["compactness", "4"],
        ["explained_variation", "1"],
    ]  # fmt: skip
    status, printed, _ = run("evaluate", mesh, labels, "--gt", labeled_strip / "one.seg")
    assert ["undersegmentation_error", "0"] in [line.split() for line in printed.splitlines()]


def test_evaluate_takes_several_ground_truths_after_one_gt(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    one, two = labeled_strip / "one.seg", labeled_strip / "two.seg"
    _, printed, _ = run("evaluate", mesh, labels, "--gt", one, two, "--json")
    facts = json.loads(printed)
    assert facts["n_ground_truths"] == 2
    assert facts["undersegmentation_error"] == pytest.approx((0 + 0.5) / 2)
    assert printed == run("evaluate", mesh, labels, "--gt", one, "--gt", two, "--json")[1]


def test_evaluate_refuses_what_does_not_fit(run, labeled_strip):
    mesh, labels = labeled_strip / "strip.ply", labeled_strip / "labels.seg"
    (labeled_strip / "short.seg").write_text("0\n")
    status, _, error = run("evaluate", mesh, labels, "--gt", labeled_strip / "short.seg")
    assert status == 1
    assert error.endswith("short.seg: there are 1 label but the mesh has 4 faces\n")
    status, _, error = run("evaluate", mesh, labels, labels)
    assert status == 2
    assert "ground truth needs --gt" in error
