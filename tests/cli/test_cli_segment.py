"""The command `segment`."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
import termios
import time

import numpy as np
import pytest
import shapes
from command_line import COMMAND, IMPATIENT, files_in

import superfacets as sf
from superfacets_cli.main import OTHER_OPTIONS
from superfacets_cli.segment import segment_command

STAGES = ["mesh", "face_graph", "weights", "order", "coarsen", "seeding", "classify", "update",
          "regions", "export"]  # fmt: skip


def test_segment_writes_a_labeled_mesh_beside_the_input(run, sheet):
    status, out, err = run("segment", sheet)
    output = sheet.with_name("sheet.superfacets.ply")
    assert (status, err) == (0, "")
    assert files_in(sheet.parent) == ["sheet.ply", "sheet.superfacets.ply"]
    expected = sf.segment(sf.read_mesh(sheet), 150)
    assert np.array_equal(sf.read_labels(output), expected.labels)
    assert np.array_equal(sf.read_mesh(output).vertices, sf.read_mesh(sheet).vertices)
    first, last = out.splitlines()
    assert first == f"wrote {output}"
    short = r"sheet\.ply: 150 regions of 1,152 faces in 0\.\d\d s"
    assert re.fullmatch(f"{short}; noise found: creases measured after 20 smoothing steps", last)
    last = run("segment", sheet, "-v")[1].splitlines()[-1]
    numbers = ", ".join(rf"{stage} \d+\.\d+" for stage in STAGES)
    facts = f"{expected.n_iter} iterations, {expected.stop_reason}"
    assert re.fullmatch(rf"{short}; .*; {facts}; seconds: {numbers}", last)


def test_the_ending_of_each_output_picks_its_format(run, sheet):
    outputs = [sheet.with_name(name) for name in ("a.npy", "b.seg", "c.txt", "D.PLY")]
    arguments = [argument for path in outputs for argument in ("-o", path)]
    status, _, _ = run("segment", sheet, "-n", 20, *arguments)
    assert status == 0
    expected = sf.segment(sheet, 20).labels
    for path in outputs:
        assert np.array_equal(sf.read_labels(path), expected), path
    assert outputs[1].read_text() == "".join(f"{label}\n" for label in expected)
    assert np.load(outputs[0]).dtype == np.int32


def test_every_option_reaches_the_library(run, sheet, tmp_path):
    output = tmp_path / "labels.npy"
    options = [
        (["-n", 30, "-a", 50], {"n_segments": 30, "alpha": 50}),
        (["-n", 30, "--eta-convex", 1, "--ridges", 0],
         {"n_segments": 30, "weights": sf.Weights(eta_convex=1, ridges=0)}),
        (["-r", 0.1, "--init", "farthest"], {"radius": 0.1, "init": "farthest"}),
        (["--init", "curve", "--max-iter", 3], {"init": "curve", "max_num_iter": 3}),
        (["-n", 30, "--tol", 0.3, "--threads", 2], {"n_segments": 30, "tol": 0.3}),
        (["-n", 30, "--weights", "superfacets", "-a", 40, "--no-smooth"],
         {"n_segments": 30, "weights": "superfacets", "alpha": 40, "smooth": False}),
        (["-n", 30, "--islands", "nearest"], {"n_segments": 30, "islands": "nearest"}),
        (["-n", 30, "--scans"], {"n_segments": 30, **sf.SCANS}),
        (["-n", 30, "--scans", "--denoise", 2], {"n_segments": 30, **sf.SCANS, "denoise": 2}),
        (["-n", 30, "--denoise", "auto"], {"n_segments": 30, "denoise": "auto"}),
        (["-n", 30, "--features", "height,normals", "--feature-weight", 2],
         {"n_segments": 30, "features": sf.Features(("height", "normals"), weight=2)}),
        (["-n", 30, "--balance", 1, "--bounds", "0.01,"],
         {"n_segments": 30, "sizes": sf.Sizes(balance=1, bounds=(0.01, None))}),
        (["--cells", 64], {"sizes": sf.Sizes(cells=64)}),
        (["-n", 9, "--max-iter", 0], {"n_segments": 9, "max_num_iter": 0}),
    ]  # fmt: skip
    for arguments, keywords in options:
        assert run("segment", sheet, *arguments, "-o", output)[0] == 0
        assert np.array_equal(np.load(output), sf.segment(sheet, **keywords).labels), arguments


def test_options_with_paper_reach_the_algorithm_of_the_paper(run, sheet, tmp_path):
    output = tmp_path / "labels.npy"
    options = [
        (["-n", 30], {"n_segments": 30}),
        (["-r", 0.1, "--init", "grid"], {"radius": 0.1, "init": "grid"}),
        (["-n", 30, "-a", 50, "--eta-convex", 1, "--max-iter", 9, "--islands", "nearest"],
         {"n_segments": 30, "alpha": 50, "eta_convex": 1, "max_num_iter": 9, "islands": "nearest"}),
    ]  # fmt: skip
    for arguments, keywords in options:
        assert run("segment", sheet, "--paper", *arguments, "-o", output)[0] == 0
        expected = sf.paper.segment(sheet, **keywords).labels
        assert np.array_equal(np.load(output), expected), arguments


def test_json_is_one_object_with_the_facts(run, sheet):
    status, out, _ = run("segment", sheet, "-n", 20, "--json")
    facts = json.loads(out)
    assert status == 0
    assert (facts["n_faces"], facts["n_segments"]) == (1152, 20)
    assert set(facts["seconds"]) == set(STAGES)
    assert facts["params"]["alpha"] == 8.3
    assert facts["outputs"] == [str(sheet.with_name("sheet.superfacets.ply"))]


@pytest.fixture
def block(tmp_path):
    """Write a CAD mesh of 272 faces, most of them long and thin, and return its path."""
    path = tmp_path / "block.ply"
    sf.write_mesh(path, shapes.drilled_block(64))
    return path


def test_slivers_are_a_note_of_one_line(run, block):
    status, _, err = run("segment", block, "-n", 100)
    assert status == 0
    assert err == (
        "superfacets: note: 37% of the area is in faces that are long and thin compared with the"
        " regions, so regions may be stripes: try --subdivide\n"
    )


def test_subdivide_writes_the_parts_and_labels_of_the_faces_of_the_input(run, block, tmp_path):
    labeled, listed = tmp_path / "labeled.ply", tmp_path / "labels.npy"
    arguments = ("segment", block, "-n", 100, "-o", labeled, "-o", listed, "--json")
    status, out, err = run(*arguments, "--subdivide")
    mesh = sf.read_mesh(block)
    radius = np.sqrt(sf.mesh_info(mesh).area / (100 * np.pi))
    parts = sf.subdivide(mesh, 0.25 * radius)
    expected = sf.segment(parts.mesh, 100).labels
    assert status == 0
    assert np.array_equal(sf.read_labels(labeled), expected)
    assert np.array_equal(sf.read_mesh(labeled).vertices, parts.mesh.vertices)
    back = parts.labels_back(expected)
    assert np.array_equal(np.load(listed), back)
    assert len(back) == mesh.n_faces
    n_lost = 100 - len(np.unique(back))
    assert n_lost > 0
    assert err == (
        f"superfacets: note: subdivision turned {mesh.n_faces} faces into {parts.mesh.n_faces}\n"
        "superfacets: note: label files, which have a label per face of the input, lack"
        f" {n_lost} regions smaller than those faces\n"
    )
    facts = json.loads(out)
    assert facts["sliver_share"] == 0
    assert facts["n_faces"] == parts.mesh.n_faces
    assert "subdivide" in facts["seconds"]


def test_a_mesh_that_is_fine_enough_is_not_said_to_be_subdivided(run, block, tmp_path):
    ids, labels = tmp_path / "a.segs.json", tmp_path / "a.npy"
    arguments = ("-n", 9, "--max-edge", 9, "-o", labels, "-o", ids)
    status, out, err = run("segment", block, *arguments)
    assert out.startswith(
        f"wrote {labels} (a label per face of block.ply)\nwrote {ids} (a label per"
    )
    assert "per vertex of block.ply)\n" in out
    note = "superfacets: note: no face was subdivided: all edges are short enough\n"
    assert (status, err[: len(note)]) == (0, note)


def test_subdivide_heeds_a_radius_or_a_longest_edge(run, block, tmp_path):
    output = tmp_path / "labeled.ply"
    mesh = sf.read_mesh(block)
    cases = [
        (["--subdivide", "-r", 0.1], 0.25 * 0.1),
        (["--max-edge", 0.2], 0.2),
        (["--subdivide", "--max-edge", 0.2, "-n", 300], 0.2),
    ]
    for arguments, max_edge in cases:
        status, _, err = run("segment", block, *arguments, "-o", output)
        assert status == 0
        assert "label files" not in err
        assert np.array_equal(sf.read_mesh(output).faces, sf.subdivide(mesh, max_edge).mesh.faces)


def test_a_longest_edge_that_makes_too_many_faces_is_refused(run, block):
    status, _, err = run("segment", block, "--max-edge", 1e-5)
    assert status == 2
    assert err.startswith("superfacets: error: max_edge=1e-05 would make more than 10000000 faces")


def test_more_regions_than_asked_for_are_explained(run, tmp_path):
    path = tmp_path / "islands.ply"
    sf.write_mesh(path, shapes.two_islands())
    status, out, err = run("segment", path, "-n", 1)
    assert status == 0
    assert "2 regions" in out
    assert err == (
        "superfacets: note: 2 regions instead of 1: 1 component got no seed;"
        " to join them to the nearest region as separate pieces, use --islands nearest\n"
    )
    islands = [np.random.default_rng(0).uniform(x, x + 1, (50, 3)) for x in (0, 90)]
    np.save(tmp_path / "islands.npy", np.concatenate(islands))
    err = run("segment", tmp_path / "islands.npy", "-n", 1)[2]
    assert "1 component got no seed;" in err
    err = run("segment", tmp_path / "islands.npy", "-r", 90)[2]
    assert "is -r in the unit of the file?" in err
    status, out, err = run("segment", path, "-n", 1, "--islands", "nearest")
    assert "1 region of 8 faces in " in out
    assert err == ""
    assert run("segment", path, "-n", 2)[2] == ""


def test_noise_that_was_found_is_in_the_last_line(run, tmp_path):
    mesh = sf.sample_mesh(20_000)
    noise = np.random.default_rng(0).normal(0, 0.003, mesh.vertices.shape)
    sf.write_mesh(tmp_path / "noisy.ply", (mesh.vertices + noise, mesh.faces))
    out = run("segment", tmp_path / "noisy.ply", "-n", 6)[1]
    assert re.search(r" s; noise found: creases measured after \d+ smoothing steps$", out.strip())
    sf.write_mesh(tmp_path / "cube.ply", shapes.cube())
    assert "; noise" not in run("segment", tmp_path / "cube.ply", "-n", 6)[1]
    out = run("segment", tmp_path / "cube.ply", "-n", 6, "--scans")[1].strip()
    assert out.endswith(" s; creases measured after 5 smoothing steps")
    assert "; noise" not in run("segment", tmp_path / "noisy.ply", "-n", 6, "--denoise", 5)[1]


@pytest.mark.parametrize(("name", "meant"), [
    ("--compactness", "use --alpha, the opp"), ("--n-superpoints", "use -n"), ("-k", "use -n"),
    ("--n", "use -n"), ("--sigma", "use --denoise"), ("--gpu", "leave it out: computations"),
    ("--min-size", "merge small regions in Python"),
    ("--cad-faces", "in Python: superfacets.cad_faces"),
    ("--classes", "names of regions are given in Python: write_mesh("),
])  # fmt: skip
def test_options_of_others_are_told_what_to_write(run, sheet, name, meant):
    status, out, error = run("segment", sheet, name, 1)
    assert (status, out, error.count("\n")) == (2, "", 1)
    assert f"No such option: {name}: {meant}" in error


def test_advice_names_options_that_exist(run, sheet):
    known = {name for each in segment_command.params for name in each.opts}
    for name, advice in OTHER_OPTIONS.items():
        assert (name in known) == advice.startswith("superfacets segment")
        words = advice.replace(",", " ").split()
        assert words[0] != "use" or words[1] in known
    assert "use -n" not in run("info", sheet, "-k", 3)[2]  # it has no -n


def test_a_radius_larger_than_the_mesh_is_a_note(run, sheet, tmp_path):
    note = "superfacets: note: the radius gives only one region: is -r in the unit of the file?\n"
    assert run("segment", sheet, "-r", 5)[2] == note
    assert note[18:] in run("batch", sheet, "-r", 5, "-o", tmp_path)[2]
    assert run("segment", sheet, "-n", 1)[2] == ""
    assert run("segment", sheet, "--cells", 2000)[2] == ""
    tiny = "regions have 1.0 faces on average: is -r in the unit of the file?"
    assert run("segment", sheet, "-r", 1e-6)[2] == f"superfacets: note: {tiny}\n"
    sf.write_mesh(tmp_path / "islands.ply", shapes.two_islands())
    err, added = run("segment", tmp_path / "islands.ply", "-r", 90)[2], "for 1 component without"
    assert added in err.splitlines()[0]
    assert err.endswith(note.replace("only one region", "only one other region"))
    large = sf.Mesh(sf.read_mesh(sheet).vertices * 9, sf.read_mesh(sheet).faces)
    sf.write_mesh(tmp_path / "pair.ply", shapes.together([large, shapes.strip(1)]))
    err = run("segment", tmp_path / "pair.ply", "-r", 2)[2]
    assert (added in err, err.count("note")) == (True, 1)


@pytest.mark.parametrize(("arguments", "message"), [
    (["-n", 0], "for '-n' / '--n-segments': '0' is not a whole number of 1 or more"),
    (["-n", "abc"], "for '-n' / '--n-segments': 'abc' is not a whole number of 1 or more"),
    (["-n", 2.5], "'2.5' is not a whole number of 1 or more"),
    (["--denoise", "foo"], "'foo' is not a whole number of 0 or more, or auto, or scan"),
    (["-n", 5, "-r", 0.1], "n_segments is 5 and radius is 0.1: give only one of them"),
    (["-n", 5, "--cells", 9], "--cells already sets the number of regions"),
    (["--cells", 9, "--bounds", "1,2"], "--cells already sets all sizes: leave bounds out"),
    (["--bounds", "2,1"], "bounds[0] must be at most bounds[1], 1, got 2"),
    (["--bounds", "5"], "for '--bounds': '5' is not LOW,HIGH"),
    (["--bounds", "a,5"], "for '--bounds': 'a,5' is not LOW,HIGH"),
    (["--feature-weight", 1], "--feature-weight needs --features"),
    (["--features", "height,"], "an item is empty"),
    (["--weights", "superfacets", "--ridges", 1],
     "weights 'superfacets' have no parameter ridges: leave it out"),
    (["-r", 0], "Invalid value for '-r' / '--radius'"),
    (["-r", "nan"], "Invalid value for '-r' / '--radius': 'nan' is not a finite number"),
    (["-r", "wide"], "Invalid value for '-r' / '--radius': 'wide' is not a valid number"),
    (["-a", -1], "Invalid value for '-a' / '--alpha': -1.0 is not in the range"),
    (["-a", "inf"], "Invalid value for '-a' / '--alpha': 'inf' is not a finite number"),
    (["--eta-convex", -1], "Invalid value for '--eta-convex'"),
    (["--init", "random"], "Invalid value for '--init'"),
    (["--max-iter", -1], "Invalid value for '--max-iter'"),
    (["--tol", -1], "Invalid value for '--tol'"),
    (["--threads", 0], "Invalid value for '--threads'"),
    (["--smoother"], "No such option"),
    (["--paper", "--weights", "creases"], "give --paper or --weights, not both"),
    (["--paper", "--scans"], "give --paper or --scans, not both"),
    (["--paper", "--no-smooth"], "give --paper or --smooth, not both"),
    (["--paper", "--balance", 0], "give --paper or --balance, not both"),
    (["--init", "flood"], "init must be one of geodesic, curve, farthest, got 'flood'"),
    (["-o", "labels.xyz"], "labels.xyz"),
])  # fmt: skip
def test_wrong_options_are_one_line_and_status_2(run, sheet, arguments, message):
    status, out, err = run("segment", sheet, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("superfacets: error: ")
    assert message in err
    assert err.count("\n") == 1
    assert files_in(sheet.parent) == ["sheet.ply"]


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


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_the_run_within_an_iteration_and_leaves_nothing(large, sent):
    command = [*IMPATIENT, "segment", large, "-n", "150", "--paper", "--max-iter", "100000"]
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    with subprocess.Popen(command, stderr=theirs, stdout=subprocess.PIPE) as process:
        shown = b""
        while b"iteration " not in shown:  # until the bar shows the loop
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


def test_the_bunny_takes_less_than_two_seconds_of_processors_as_a_whole_process(data_dir, tmp_path):
    """The limit is several times the usual processor time. Wall time depends on other programs."""
    bunny = data_dir / "meshes" / "bunny.ply"
    command = [*COMMAND, "segment", str(bunny), "-o", str(tmp_path / "bunny.ply")]
    before = os.times()
    subprocess.run(command, check=True, capture_output=True)
    after = os.times()
    spent = after.children_user + after.children_system
    assert spent - before.children_user - before.children_system < 2.0


@pytest.fixture
def three(sheet):
    """Return a valid file, an invalid file, and another valid file."""
    bad, other = sheet.with_name("bad.ply"), sheet.with_name("other.ply")
    bad.write_bytes(b"junk")
    sf.write_mesh(other, shapes.bumpy_sheet(6))
    return sheet, bad, other


def test_a_bad_file_does_not_stop_the_others(run, three):
    status, out, err = run("segment", *three, "-n", 7)
    assert status == 1
    assert err.splitlines() == [
        f"superfacets: error: {three[1]}: not a PLY file: it does not begin with the word ply",
        "superfacets: error: 1 of 3 files failed",
    ]
    assert re.findall(r"^(.*): 7 regions of [\d,]+ faces", out, re.MULTILINE) == [
        "sheet.ply",
        "other.ply",
    ]
    assert files_in(three[0].parent) == [
        "bad.ply", "other.ply", "other.superfacets.ply", "sheet.ply", "sheet.superfacets.ply",
    ]  # fmt: skip


def test_json_is_one_line_per_input_of_those_that_fail_too(run, three):
    status, out, _ = run("segment", *three, "-n", 7, "--json")
    assert status == 1
    objects = [json.loads(line) for line in out.splitlines()]
    assert [facts["file"] for facts in objects] == [str(path) for path in three]
    assert [facts.get("n_faces") for facts in objects] == [1152, None, 72]
    assert "not a PLY file" in objects[1]["error"]


def test_an_error_that_names_no_file_gets_its_name(run, three, broken):
    broken("superfacets.tools.segment_file.segment", MemoryError)
    _, _, err = run("segment", *three)
    assert f"superfacets: error: {three[0]}: not enough memory\n" in err
    _, _, err = run("segment", three[0])
    assert err == "superfacets: error: not enough memory\n"


def test_a_count_larger_than_the_mesh_gives_every_face_a_region(run, three):
    output = three[0].with_name("labels.npy")
    status, out, err = run("segment", three[2], "-n", 73, "-o", output)
    assert status == 0
    assert "72 regions of 72 faces" in out
    assert err == (
        "superfacets: note: 73 regions were requested, but there are only 72 faces: each face"
        " became a region\n"
    )
    assert np.array_equal(np.load(output), sf.segment(three[2], 72).labels)
    assert run("segment", three[2], "-n", 72, "-o", output)[2] == ""
    sf.write_mesh(three[0], (block := shapes.drilled_block(256)))
    for n in (100, block.n_faces + 1):
        err = run("segment", three[0], "-n", n, "-o", output)[2]
        assert ("long and thin" in err) == (n == 100)


def test_quiet_prints_errors_alone(run, three, terminal):
    terminal(sys.stderr)
    arguments = ["-n", 2000, "--islands", "nearest", "-q"]
    status, out, err = run("segment", *three, *arguments)
    assert (status, out) == (1, "")
    assert [line.split(": ")[1] for line in err.splitlines()] == ["error", "error"]
    status, out, err = run("segment", three[0], *arguments, "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["n_segments"] == 1152


@pytest.fixture
def colored(tmp_path):
    """Write a labeled mesh with vertex colors, a face property, a comment and an extra element."""
    path = tmp_path / "colored.ply"
    mesh = shapes.bumpy_sheet(6)
    attributes = sf.MeshAttributes(
        {"red": np.arange(mesh.n_vertices) % 256},
        {"material": np.arange(mesh.n_faces)},
        ["comment TextureFile a.png"],
    )
    sf.write_mesh(path, mesh, np.zeros(mesh.n_faces, int), attributes=attributes, ascii=True)
    text = path.read_text().replace("end_header", "element edge 1\nproperty int a\nend_header")
    path.write_text(text + "7\n")
    return path


def test_a_labeled_mesh_keeps_what_the_input_held(run, colored):
    output = colored.with_name("out.ply")
    status, _, err = run("segment", colored, "-n", 5, "-o", output)
    assert status == 0
    notes = [
        "data of the input that is not copied: element edge",
        "in .ply, new values replace face properties label, quality, red, green, blue",
    ]  # fmt: skip
    assert err.splitlines() == [f"superfacets: note: {note}" for note in notes]
    found = sf.read_attributes(output)
    assert np.array_equal(found.vertex["red"], np.arange(len(found.vertex["red"])) % 256)
    assert np.array_equal(found.face["material"], np.arange(72))
    assert found.comments == ("comment TextureFile a.png",)
    assert sf.read_labels(output).max() == 4


def test_attributes_are_dropped_on_request_and_where_only_labels_are_written(run, colored):
    output, labels = colored.with_name("out.ply"), colored.with_name("out.npy")
    assert run("segment", colored, "-o", output, "--drop-attributes")[2] == ""
    assert list(sf.read_attributes(output).vertex) == []
    assert run("segment", colored, "-o", labels)[2] == ""


INTERRUPTED_AT = """
import os, signal, threading, time
from superfacets_cli.main import main
from {module} import {function}
import {module} as module

def slow(*arguments, **keywords):
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    time.sleep(30)

module.{function} = slow
main()
"""


@pytest.mark.parametrize(("module", "function"), [
    ("superfacets_cli.inputs", "read_input"),
    ("superfacets.tools.segment_file", "segment"),
    ("superfacets.files.writers.ply", "_rows"),
])  # fmt: skip
def test_an_interrupt_is_heard_in_every_stage(sheet, module, function):
    """An interrupt also ends the command in stages that run in the C++ core for a long time."""
    code = INTERRUPTED_AT.format(module=module, function=function)
    command = [sys.executable, "-c", code, "segment", str(sheet)]
    start = time.perf_counter()
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert time.perf_counter() - start < 20
    assert ended.returncode == 130
    assert ended.stderr.strip() == "superfacets: error: interrupted"
    assert files_in(sheet.parent) == ["sheet.ply"]


def test_parts_of_faces_keep_the_attributes_of_the_faces(run, colored):
    output, mesh = colored.with_name("out.ply"), sf.read_mesh(colored)
    face, comments = {"material": np.arange(72)}, ["comment TextureFile a.png"]
    side = mesh.vertices @ [30.0, 20.0, 40.0] + 50  # linear, so interpolation is exact
    vertex = {"side": side, "blue": np.rint(side).astype(np.uint8), "kind": np.arange(49)}
    sf.write_mesh(colored, mesh, attributes=sf.MeshAttributes(vertex, face, comments))
    status, _, err = run("segment", colored, "-n", 5, "-o", output, "--subdivide")
    assert (status, "not copied" in err) == (0, False)
    found, vertices = sf.read_attributes(output), sf.read_mesh(output).vertices
    assert len(vertices) > 49
    assert np.allclose(found.vertex["side"], vertices @ [30.0, 20.0, 40.0] + 50, atol=1e-4)
    assert np.abs(found.vertex["blue"] - found.vertex["side"]).max() < 1.01
    assert {*found.vertex["kind"][49:]} <= {*range(49)}
    radius = np.sqrt(sf.mesh_info(mesh).area / (5 * np.pi))
    assert np.array_equal(found.face["material"], sf.subdivide(mesh, 0.25 * radius).sources)
    assert found.comments == ("comment TextureFile a.png",)
    sf.write_mesh(colored, shapes.house(), attributes=sf.MeshAttributes({"red": np.arange(5)}))
    err = run("segment", colored, "-n", 1, "-o", output, "--subdivide")[2]
    assert "not copied: vertex properties red, because triangles replace polygons\n" in err


def test_a_feature_without_effect_is_a_note(run, tmp_path):
    sf.write_mesh(tmp_path / "flat.ply", shapes.strip(8))
    status, _, err = run("segment", tmp_path / "flat.ply", "-n", 4, "--features", "height")
    assert status == 0
    assert "note: height: all cells have the same value, so this has no effect\n" in err
