"""Masks and barriers of the command `segment`."""

import json

import numpy as np
import pytest
import shapes

import superfacets as sf


@pytest.fixture
def halves(sheet, tmp_path):
    """Write labels of the left and right half, and of the lower and upper half, of a sheet."""
    mesh = sf.read_mesh(sheet)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    of = {"left": middle[:, 0], "low": middle[:, 1]}
    for name, values in of.items():
        sf.write_labels(tmp_path / f"{name}.npy", (values < np.median(values)).astype(int))
    return tmp_path


def test_segment_takes_masks_and_barriers_from_files(run, sheet, halves):
    left, low = (np.load(halves / f"{name}.npy") for name in ("left", "low"))
    options = ("-n", 12, "--mask", halves / "left.npy", "--barriers", halves / "low.npy")
    out = halves / "out.seg"
    status, _, err = run("segment", sheet, *options, "-o", out, "-o", halves / "out.ply")
    assert (status, err) == (0, "")
    expected = sf.segment(sf.read_mesh(sheet), 12, mask=left == 1, barriers=low).labels
    assert np.array_equal(sf.read_labels(out), expected)
    assert np.array_equal(sf.read_labels(halves / "out.ply"), expected)
    status, _, err = run("segment", sheet, "-n", 9999, *options[2:], "-o", out)
    assert status == 0
    assert "9999 regions were requested" in err
    assert sf.read_labels(out).max() == left.sum() - 1


def test_masks_and_barriers_follow_a_subdivision(run, sheet, halves):
    left = np.load(halves / "left.npy")
    options = ("--mask", halves / "left.npy", "--barriers", halves / "low.npy", "--subdivide")
    status, _, err = run("segment", sheet, "-n", 60, *options, "-o", halves / "out.npy")
    assert status == 0
    assert "subdivision turned 1152 faces into 17882" in err
    labels = np.load(halves / "out.npy")
    assert np.array_equal(labels == -1, left == 0)


def test_parts_that_barriers_keep_from_joining_are_told(run, tmp_path):
    sizes = {0: 12, 9: 8, 20: 8}  # the first is the largest and gets the seed
    strips = [
        sf.Mesh(shapes.strip(n).vertices + [x, 0, 0], shapes.strip(n).faces)
        for x, n in sizes.items()
    ]
    sf.write_mesh(tmp_path / "strips.ply", shapes.together(strips))
    sf.write_labels(tmp_path / "sides.npy", np.repeat([0, 1, 0], [12, 8, 8]))
    options = ("--barriers", tmp_path / "sides.npy", "--islands", "nearest")
    status, _, err = run("segment", tmp_path / "strips.ply", "-n", 1, *options)
    assert status == 0
    assert err.splitlines() == [
        "superfacets: note: 2 regions instead of 1: 1 part between barriers got no seed and cannot"
        " join a region"
    ]


@pytest.mark.parametrize(("command", "name"), [("segment", "out.seg"), ("levels", "out.9.seg")])
def test_a_mask_keeps_the_given_values(run, sheet, tmp_path, command, name):
    mesh = sf.read_mesh(sheet)
    places = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    classes = 2 * np.searchsorted(np.quantile(places, [0.25, 0.5, 0.75]), places)  # 0, 2, 4, 6
    sf.write_labels(tmp_path / "classes.seg", classes)
    options = ("-n", 9, "--mask", tmp_path / "classes.seg", "-o", tmp_path / "out.seg")
    assert run(command, sheet, *options, "--mask-values", "0,6")[0] == 0
    kept = (classes == 0) | (classes == 6)
    labels = sf.read_labels(tmp_path / name)
    assert np.array_equal(labels >= 0, kept)
    assert np.array_equal(labels, sf.segment(sf.read_mesh(sheet), 9, mask=kept).labels)


def test_values_of_a_mask_that_are_wrong_are_a_usage_error(run, sheet):
    status, _, err = run("segment", sheet, "--mask", "m.npy", "--mask-values", "six")
    assert status == 2
    assert "'six' is not a whole number of 0 or more" in err


@pytest.mark.parametrize("command", ["segment", "levels"])
def test_without_a_mask_file_the_input_has_the_values(run, sheet, tmp_path, command):
    mesh = sf.read_mesh(sheet)
    places = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    kept = places < np.median(places)
    options = ("-n", 9, "--mask-values", 6, "--labels-named", "kind", "-o", tmp_path / "out.npy")
    for name, is_kept in {"a": kept, "b": ~kept}.items():
        kinds = sf.MeshAttributes(face={"kind": np.where(is_kept, 6, 2).astype(np.int32)})
        sf.write_mesh(tmp_path / f"{name}.ply", mesh, attributes=kinds)
    if command == "levels":
        assert run(command, tmp_path / "a.ply", *options)[0] == 0
        assert np.array_equal(np.load(tmp_path / "out.9.npy") >= 0, kept)
        return
    inputs = [tmp_path / "a.ply", tmp_path / "b.ply"]
    status, _, err = run(command, *inputs, *options[:-1], tmp_path, "--to", "npy")
    assert (status, err) == (0, "")
    expected = sf.segment(mesh, 9, mask=~kept).labels
    assert np.array_equal(np.load(tmp_path / "a.superfacets.npy") >= 0, kept)
    assert np.array_equal(np.load(tmp_path / "b.superfacets.npy"), expected)


@pytest.mark.parametrize("option", ["--mask", "--barriers"])
def test_a_mask_or_barriers_of_one_input_are_not_used_for_another(run, sheet, halves, option):
    (halves / "other.ply").write_bytes(sheet.read_bytes())
    inputs, output = (sheet, halves / "other.ply"), ("-o", halves / "out", "--to", "npy")
    status, _, err = run("segment", *inputs, option, halves / "left.npy", *output)
    assert status == 2
    assert "files of --mask and --barriers fit only one input" in err


@pytest.mark.parametrize("command", ["segment", "levels"])
def test_values_that_no_cell_has_are_named(run, sheet, halves, command):
    options = ("-n", 9, "-o", halves / "out.npy", "--mask")
    status, _, err = run(command, sheet, *options, halves / "left.npy", "--mask-values", "9")
    assert status == 1
    assert err == f"superfacets: error: {halves / 'left.npy'}: no face has the value 9\n"
    sf.write_labels(halves / "zeros.npy", np.zeros(1152, int))
    status, _, err = run(command, sheet, *options, halves / "zeros.npy")
    assert (status, err.count("no face has a value other than 0")) == (1, 1)
    attributes = sf.MeshAttributes(vertex={"kind": np.full(9, 2)})
    sf.write_mesh(halves / "cloud.ply", sf.PointCloud(np.eye(9, 3)), attributes=attributes)
    named = ("--mask-values", "6,9", "--labels-named", "kind")
    status, _, err = run(command, halves / "cloud.ply", *options[:-1], *named)
    assert (status, err.count("cloud.ply: no point has the value 6 or 9\n")) == (1, 1)


@pytest.mark.parametrize(("mask", "message"), [
    (np.ones(3, bool),
     "m.npy: labels must have one value per face (1152) or per vertex (625), got 3 values"),
    (np.ones((1152, 1), bool), "m.npy: labels must be one-dimensional"),
    (np.ones(1152), "m.npy: labels must contain integers, got float64"),
])  # fmt: skip
def test_masks_that_do_not_fit_are_one_line(run, sheet, tmp_path, mask, message):
    np.save(tmp_path / "m.npy", mask)
    for option in ("--mask", "--barriers"):
        status, _, err = run("segment", sheet, option, tmp_path / "m.npy")
        assert (status, err.count("\n"), message in err) == (1, 1, True)


@pytest.mark.parametrize(("command", "name"), [("segment", "out.seg"), ("levels", "out.12.seg")])
def test_files_that_hold_more_have_the_labels_that_are_named(run, sheet, halves, command, name):
    left, low = (np.load(halves / f"{side}.npy") for side in ("left", "low"))
    for side, values in {"left": left, "low": low}.items():
        attributes = sf.MeshAttributes(face={"side": values.astype(np.int32)})
        sf.write_mesh(halves / f"{side}.ply", sf.read_mesh(sheet), attributes=attributes)
    files = ("--mask", halves / "left.ply", "--barriers", halves / "low.ply")
    options = (*files, "-n", 12, "-o", halves / "out.seg")
    status, _, err = run(command, sheet, *options, "--labels-named", "side")
    assert (status, err) == (0, "")
    expected = sf.segment(sf.read_mesh(sheet), 12, mask=left == 1, barriers=low).labels
    assert np.array_equal(sf.read_labels(halves / name), expected)
    status, _, err = run(command, sheet, *options)
    assert (status, err.count("\n")) == (1, 1)
    assert "left.ply: " in err


def test_clouds_have_no_labels_of_vertices(run, tmp_path, broken):
    sf.write_mesh(tmp_path / "cloud.ply", sf.PointCloud(np.random.default_rng(0).random((99, 3))))
    broken("superfacets.tools.segment_file.segment")
    status, _, err = run("segment", tmp_path / "cloud.ply", "--vertex-labels", "-n", 3)
    assert (status, "vertex_labels needs faces with labels" in err) == (1, True)
    status, _, err = run("segment", tmp_path / "cloud.ply", "-n", 3, "-o", tmp_path / "x.vtp")
    assert (status, "points are written as" in err) == (1, True)


def test_masks_and_barriers_are_not_replaced(run, sheet, halves):
    for option in ("--mask", "--barriers"):
        status, _, err = run("segment", sheet, option, halves / "low.npy", "-o", halves / "low.npy")
        assert (status, "the output would overwrite the input" in err) == (2, True)


def test_a_barrier_angle_gives_a_region_per_face_of_a_part(run, tmp_path):
    block = shapes.drilled_block(64)
    sf.write_mesh(tmp_path / "block.ply", block)
    out = tmp_path / "out.npy"
    options = ("-n", 1, "--barrier-angle", 30, "--force", "-o", out)
    status, report, err = run("segment", tmp_path / "block.ply", *options)
    assert (status, err) == (0, "")
    assert report.endswith("; all sharp edges are on borders\n")
    labels = np.load(out)
    assert len(np.unique(labels)) == 7
    status, _, err = run("segment", tmp_path / "block.ply", *options, "--max-edge", 0.3)
    assert status == 0
    assert "more regions" not in err
    assert len(np.unique(labels * 7 + np.load(out))) == 7  # the same faces, subdivided
    status, _, err = run("segment", tmp_path / "block.ply", "-n", 12, "--balance", 1, *options[2:])
    assert (status, err) == (0, "")
    assert len(np.unique(np.load(out))) == 12
    status, _, err = run("segment", tmp_path / "block.ply", "-n", 2, *options[2:])
    assert (status, err) == (
        0,
        "superfacets: note: 7 regions instead of 2: barriers divide the cells into"
        " components, each of which has at least one region\n",
    )
    for angle, share in [(30, 0), (91, None)]:  # no edge is as sharp as 91 degrees
        given = ("-n", 9, "--barrier-angle", angle, *options[4:])
        status, report, _ = run("segment", tmp_path / "block.ply", *given, "--json")
        assert (status, json.loads(report)["sharp_inside"]) == (0, share)
    assert "sharp edges" not in run("segment", tmp_path / "block.ply", *given)[1]


def test_sharp_edges_inside_regions_are_noted(run, tmp_path):
    """A fold of 90 degrees, which becomes flat over 10 edges, ends inside the only region."""
    x, y = np.meshgrid(np.arange(-5.0, 6.0), np.arange(11.0), indexing="ij")
    z = np.abs(x) * (1 - y / 10)
    folded = sf.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), shapes.bumpy_sheet(10).faces)
    sf.write_mesh(tmp_path / "fold.ply", folded)
    assert 0 < len(sf.sharp_edges(folded, 30)) < 10
    options = ("-n", 1, "--barrier-angle", 30, "-o")
    status, _, err = run("segment", tmp_path / "fold.ply", *options, tmp_path / "fold.npy")
    assert (status, err) == (
        0,
        "superfacets: note: 100% of the length of sharp edges is inside region 0: these edges do"
        " not enclose an area, because some edges between their ends bend by less than"
        " --barrier-angle; if the mesh has no noise, try a smaller angle, or"
        " superfacets.cad_faces in Python\n",
    )
    lengths = np.linalg.norm(np.diff(folded.vertices[sf.sharp_edges(folded, 30)], axis=1), axis=-1)
    cube = shapes.cube()  # its edges are between regions
    moved = [(0, folded), (20, folded), (40, cube), (50, cube)]
    apart = [sf.Mesh(mesh.vertices + [x, 0, 0], mesh.faces) for x, mesh in moved]
    sf.write_mesh(tmp_path / "all.ply", shapes.together(apart))
    status, _, err = run("segment", tmp_path / "all.ply", *options, tmp_path / "all.npy")
    assert status == 0
    side = np.ptp(cube.vertices[:, 0])
    percent = 100 * lengths.sum() / (lengths.sum() + 12 * side)
    assert f" {percent:.3g}% of the length of sharp edges is inside region 0 and 1 other: " in err
    status, report, _ = run("segment", tmp_path / "all.ply", *options, tmp_path / "x.npy", "--json")
    assert json.loads(report)["sharp_inside"] == pytest.approx(percent / 100)
    five = [sf.Mesh(folded.vertices + [x, 0, 0], folded.faces) for x in range(0, 100, 20)]
    sf.write_mesh(tmp_path / "five.ply", shapes.together(five))
    _, _, err = run("segment", tmp_path / "five.ply", *options, tmp_path / "five.npy")
    assert "100% of the length of sharp edges is inside region 0 and 4 others: " in err


def test_a_barrier_angle_of_points_is_one_line(run, tmp_path):
    np.save(tmp_path / "cloud.npy", np.random.default_rng(0).random((50, 3)))
    status, _, err = run("segment", tmp_path / "cloud.npy", "--barrier-angle", 30)
    assert (status, err.count("\n")) == (1, 1)
    assert f"{tmp_path / 'cloud.npy'}: --barrier-angle and --subdivide: expected a surface" in err


@pytest.mark.parametrize(("more", "message"), [
    (["--barriers", "m.npy"], "give --barriers or --barrier-angle, not both"),
    (["--barrier-angle", 0], "0.0 is not in the range"),
])  # fmt: skip
def test_what_a_barrier_angle_does_not_go_with_is_one_line(run, sheet, tmp_path, more, message):
    np.save(tmp_path / "m.npy", np.zeros(1152, int))
    more = [tmp_path / text if text == "m.npy" else text for text in more]
    status, _, err = run("segment", sheet, "--barrier-angle", 30, *more)
    assert (status, err.count("\n")) == (2, 1)
    assert message in err


@pytest.mark.parametrize("name", ["m.npy", "m.annot", "m.label.gii"])
def test_mask_values_are_the_labels_that_python_reads(run, sheet, tmp_path, name):
    mesh, path, out = sf.read_mesh(sheet), tmp_path / name, tmp_path / "out.npy"
    sf.write_labels(path, np.digitize(mesh.vertices[:, 0], [-1, 1]))
    status, _, err = run("segment", sheet, "-n", 5, "--mask", path, "--mask-values", 1, "-o", out)
    assert status == 0, err
    assert np.array_equal(np.load(out) >= 0, sf.face_labels(mesh, sf.read_labels(path)) == 1)


@pytest.mark.parametrize("ending", ["npy", "annot", "label.gii", "shape.gii", "curv", "label"])
def test_masks_and_barriers_may_have_a_value_per_vertex(run, sheet, tmp_path, ending):
    mesh = sf.read_mesh(sheet)
    is_left = mesh.vertices[:, 0] < np.median(mesh.vertices[:, 0])
    sf.write_labels(tmp_path / "m.label.gii", is_left - 1)  # the key of label -1 is 0
    sf.write_labels(tmp_path / "m.annot", is_left - 1)
    np.save(tmp_path / "m.npy", is_left)
    numbers = b"\xff" * 3 + np.array([mesh.n_vertices, mesh.n_faces, 1], ">i4").tobytes()
    (tmp_path / "m.curv").write_bytes(numbers + is_left.astype(">f4").tobytes())
    rows = "".join(f"\n{i} 0 0 0 0" for i in np.flatnonzero(is_left))
    (tmp_path / "m.label").write_text(f"#!ascii label\n{is_left.sum()}{rows}\n")
    text = (tmp_path / "m.label.gii").read_text()
    (tmp_path / "m.shape.gii").write_text(text.replace("INTENT_LABEL", "INTENT_SHAPE"))
    out, wanted = tmp_path / "out.npy", sf.face_labels(mesh, is_left.astype(int))
    for option, given in (("--mask", {"mask": wanted == 1}), ("--barriers", {"barriers": wanted})):
        status, _, err = run("segment", sheet, "-n", 9, option, tmp_path / f"m.{ending}", "-o", out)
        assert status == 0, err
        assert np.array_equal(np.load(out), sf.segment(mesh, 9, **given).labels)


def test_labels_of_vertices_stay_within_masks_and_barriers_of_vertices(run, sheet, tmp_path):
    path, mesh = tmp_path / "m.annot", sf.read_mesh(sheet)
    areas = np.digitize(mesh.vertices @ [1, 0.3, 0], [0.3, 0.6, 0.9]) - 1
    sf.write_labels(path, areas)
    for command, n in (("segment", ""), ("levels", ".9")):
        given = ("-n", 9, "--mask", path, "--barriers", path, "-o", tmp_path / "out.annot")
        assert run(command, sheet, *given)[0] == 0
        labels = sf.read_labels(tmp_path / f"out{n}.annot")
        assert not ((labels >= 0) & (areas < 0)).any()
        assert all(len({*areas[labels == region]}) == 1 for region in range(9))
