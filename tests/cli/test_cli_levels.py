"""The command `levels`."""

import json

import numpy as np
import pytest
from command_line import files_in

import superfacets as sf
from superfacets import SCANS, hierarchy, read_labels, read_mesh, segment, write_labels
from superfacets.kit import FORMATS, OutputFiles


def test_levels_writes_all_levels_to_one_file(run, sheet, tmp_path):
    status, out, err = run("levels", sheet, "-n", "5,40,12", "-o", tmp_path / "all.npz")
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        f"wrote {tmp_path / 'all.npz'}",
        "sheet.ply: 1152 faces, levels of 40, 12, 5 regions",
    ]
    nested = hierarchy(read_mesh(sheet), [40, 12, 5])
    with np.load(tmp_path / "all.npz") as found:
        assert sorted(found) == [
            "children", "costs", "counts", "finest", "labels", "parents_0", "parents_1",
        ]  # fmt: skip
        assert found["counts"].tolist() == [40, 12, 5]
        assert np.array_equal(found["labels"], nested.levels)
        assert np.array_equal(found["parents_1"], nested.parents[1])
        assert np.array_equal(found["parents_0"][found["labels"][0]], found["labels"][1])
        assert np.array_equal(found["children"], nested.children)


def test_levels_writes_a_file_for_each_level(run, sheet, tmp_path):
    labels = segment(read_mesh(sheet), 30).labels
    write_labels(tmp_path / "fine.npy", labels)
    options = ("--labels", tmp_path / "fine.npy", "--threads", 1, "--json")
    status, out, _ = run("levels", sheet, "-n", "7,20", "-o", tmp_path / "out.seg", *options)
    assert status == 0
    assert json.loads(out) == {
        "file": str(sheet), "levels": [20, 7], "n_finest": 30, "n_fewest": 1,
        "outputs": [str(tmp_path / "out.20.seg"), str(tmp_path / "out.7.seg")],
    }  # fmt: skip
    nested = hierarchy(read_mesh(sheet), [20, 7], labels=labels)
    for count, expected in zip((20, 7), nested.levels, strict=True):
        assert np.array_equal(read_labels(tmp_path / f"out.{count}.seg"), expected)
    assert run("levels", sheet, "-n", 6, "-o", tmp_path / "part.ply")[0] == 0
    assert len(np.unique(read_labels(tmp_path / "part.6.ply"))) == 6


@pytest.mark.parametrize("ending", [".segs.json", ".aggregation.json", "_sp_label.npy", ".SEG"])
def test_the_number_of_a_level_stands_before_the_whole_ending(run, sheet, tmp_path, ending):
    assert run("levels", sheet, "-n", "5,12", "-o", tmp_path / f"a{ending}", "-q") == (0, "", "")
    assert files_in(tmp_path) == sorted([f"a.12{ending}", f"a.5{ending}", "sheet.ply"])
    (tmp_path / "other").mkdir()
    expected = tmp_path / "other"
    for n, labels in zip((12, 5), hierarchy(read_mesh(sheet), [12, 5]).levels, strict=True):
        path = expected / f"a.{n}{ending}"  # same name, as some formats store the scene name
        OutputFiles([path]).write(read_mesh(sheet), labels)
        if n == 12 or ending in (".aggregation.json", ".SEG"):  # no labels of vertices
            assert (tmp_path / path.name).read_bytes() == path.read_bytes()


@pytest.mark.parametrize("ending", [".segs.json", "_sp_label.npy", ".annot", ".label.gii"])
def test_levels_are_nested_at_the_vertices(run, sheet, tmp_path, ending):
    mesh = sf.sample_mesh(9000)
    sf.write_mesh(tmp_path / "bear.ply", mesh)
    first = ("levels", tmp_path / "bear.ply", "-n", "40,12", "-o", tmp_path / f"a{ending}")
    assert run(*first)[0] == 0
    fine, coarse = (read_labels(tmp_path / f"a.{n}{ending}") for n in (40, 12))
    assert [len(np.unique(each)) for each in (fine, coarse)] == [40, 12]
    assert len(np.unique([fine, coarse], axis=1).T) == 40

    given = sf.vertex_labels(mesh, segment(mesh, 40))  # 20 vertices or more, so also a face
    given = np.where(given % 2, given, -1) if ending in FORMATS.key_labels else given
    write_labels(tmp_path / "given.annot", given)
    n = len(np.unique(given[given >= 0]))
    again = ("-n", f"{n},{n - 5},7", "-o", tmp_path / f"b{ending}", "--islands", "nearest")
    assert run(*first[:2], tmp_path / "given.annot", *again)[0] == 0
    found = [read_labels(tmp_path / f"b.{n}{ending}") for n in (n, n - 5, 7)]
    assert len(np.unique([given, *found], axis=1).T) == len(np.unique(given))
    assert [len(np.unique(each[given >= 0])) for each in found] == [n, n - 5, 7]
    assert all(np.array_equal(each < 0, given < 0) for each in found)


def test_levels_takes_masks_barriers_and_features(run, sheet, tmp_path):
    mesh = read_mesh(sheet)
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    mask, low = middle[:, 0] < 0.7, (middle[:, 1] < 0.5).astype(int)
    np.save(tmp_path / "mask.npy", mask)
    write_labels(tmp_path / "low.seg", low)
    options = ("--mask", tmp_path / "mask.npy", "--barriers", tmp_path / "low.seg")
    out, height = tmp_path / "a.npz", str(tmp_path / "height.npy")
    np.save(height, np.where(mask, middle[:, 2], np.nan))
    status, _, err = run("levels", sheet, "-n", 2, "--features", height, "-o", out)
    assert (status, f"{height}: {np.sum(~mask)} faces without a finite value" in err) == (1, True)
    assert run("levels", sheet, "-n", "20,6", *options, "--features", height, "-o", out)[0] == 0
    nested = hierarchy(mesh, [20, 6], mask=mask, barriers=low, features=middle[:, 2:])
    with np.load(out) as found:
        assert np.array_equal(found["labels"], nested.levels)
    assert (nested.levels[0] == -1).any()
    assert run("levels", sheet, "-n", "9", "--scans", "--denoise", 7, "-o", out)[0] == 0
    wanted = hierarchy(mesh, [9], **{**SCANS, "denoise": 7}).levels
    assert np.array_equal(np.load(out)["labels"], wanted)
    assert run("levels", sheet, tmp_path / "low.seg", "-n", 2, "--scans", "-o", out)[0] == 2


def test_levels_notes_lost_names_and_another_hemisphere(run, sheet, tmp_path):
    mesh, left, right = read_mesh(sheet), tmp_path / "lh.white.ply", tmp_path / "rh.a.annot"
    of_vertices = sf.vertex_labels(mesh, segment(mesh, 9))
    for names in (None, [f"area {i}" for i in range(9)]):
        sf.write_mesh(right, mesh, of_vertices, classes=names)
        err = run("levels", sheet, right, "-n", 3, "-o", tmp_path / "b.annot")[2]
        assert (f"names of regions are not copied from {right}" in err) == (names is not None)
        assert "hemisphere" not in err
    err = run("levels", sheet.rename(left), right, "-n", 3, "-o", tmp_path / "b.annot")[2]
    assert f"note: {right}: another hemisphere than {left}, according to the names" in err


@pytest.mark.parametrize("side", [-9, 9])
def test_levels_of_a_cloud_are_seen_from_the_viewpoint(run, tmp_path, side):
    points = np.random.default_rng(0).random((900, 3)) * 2 - 1
    points[:, 2] = np.abs(points[:, 0])  # a valley, or a ridge
    np.save(tmp_path / "cloud.npy", points)
    given = ("-n", "30,8", "--viewpoint", f"0,0,{side}", "-o", tmp_path / "a.npz")
    assert run("levels", tmp_path / "cloud.npy", *given)[0] == 0
    nested = hierarchy(sf.PointCloud(points, viewpoints=[0, 0, side]), [30, 8])
    assert np.array_equal(np.load(tmp_path / "a.npz")["labels"], nested.levels)
    assert not np.array_equal(nested.levels, hierarchy(points, [30, 8]).levels)


def test_levels_replaces_no_input(run, sheet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sheet.rename("x.10.ply")
    write_labels("l.10.npy", np.arange(1152) // 100)
    np.save("m.10.npy", np.ones(1152, int))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for out, *options in [
        ("x.ply",), ("l.npy", "--labels", "./l.10.npy"), ("m.npy", "--mask", "m.10.npy"),
        ("m.npy", "--barriers", tmp_path / "m.10.npy"),
    ]:  # fmt: skip
        status, _, err = run("levels", "x.10.ply", "-n", "10,5", "-o", out, *options)
        assert status == 2
        assert "the output would overwrite the input" in err
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_levels_writes_all_files_or_none(run, sheet, tmp_path, monkeypatch):
    written = []

    def write(file, content):
        written.append(file.write(b"part"))
        if len(written) == 2:
            raise OSError(28, "No space left on device")

    monkeypatch.setitem(FORMATS["write_polygons"], ".ply", write)
    status, _, err = run("levels", sheet, "-n", "10,5", "-o", tmp_path / "x.ply")
    assert (status, len(written)) == (1, 2)
    assert "No space left on device" in err
    assert files_in(tmp_path) == ["sheet.ply"]


def test_numbers_without_commas_are_an_error_that_says_so(run, sheet, tmp_path):
    for numbers, message in [
        (["9", "5"], "extra argument 5: put commas"), (["9", "5", "3"], "(3): put commas"),
        (["9 5"], "'9 5' needs commas between its items"),
    ]:  # fmt: skip
        status, _, err = run("levels", sheet, "-n", *numbers, "-o", tmp_path / "x.npz")
        assert (status, message in err) == (2, True)


def test_levels_finds_out_before_the_work_what_cannot_be_written(run, tmp_path, broken):
    sf.write_mesh(tmp_path / "cloud.ply", sf.PointCloud(np.random.default_rng(0).random((99, 3))))
    np.save(tmp_path / "l.npy", np.arange(99) // 10 - 1)
    broken("superfacets_cli.levels.hierarchy")
    given = ("levels", tmp_path / "cloud.ply", "-n", 3, "--labels", tmp_path / "l.npy", "-o")
    for name, message in [
        ("a.sstk.json", ".sstk.json needs labels of triangles, but the cells are points"),
        ("a.vtp", "points are written as"),
        ("a.segs.json", "labels[0] must be >= 0 in .segs.json, got -1"),
    ]:
        status, _, err = run(*given, tmp_path / name)
        assert status == 1
        assert message in err


@pytest.mark.parametrize(("options", "status", "message"), [
    (("-n", "3,x", "-o", "out.npz"), 2, "'x' is not a whole number of 1 or more"),
    (("-n", "3"), 2, "Missing option '-o'"),
    (("-n", "3", "-o", "out.xyz"), 2, "out.xyz: expected the ending .ply, .vtp,"),
    (("-n", "3", "-o", "no/out.npz"), 1, "the folder no does not exist"),
    (("-n", "3", "-o", "no/out.seg"), 1, "the folder no does not exist"),
    (("-n", "3", "-o", "sheet.ply", "--labels", "sheet.3.ply"), 2, "overwrite the input"),
    (("-n", "3", "-o", "x_sp_label.npy", "--labels", "m.npy"), 1, "m.npy"),
    (("-n", "3", "-o", "x.npy", "--mask", "m", "--labels", "l"), 2,
     "give LABELS or a mask, --scans or --denoise, not both"),
    (("-n", "3", "-o", "x.las"), 1, "faces are written as .ply, .vtp"),
    (("-n", "3", "-o", "x.csv"), 1, "for a table of regions, use superfacets regions"),
    (("-n", "3", "-o", "x.npy", "--features", "heat"), 1,
     "features heat: the mesh has no property heat; it has normals"),
    (("-n", "9999", "-o", "out.npz"), 2,
     "error: -n must be at most 1152, the number of faces, got 9999"),
])  # fmt: skip
def test_levels_refuses_what_cannot_be(run, sheet, monkeypatch, tmp_path, options, status, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = run("levels", sheet, *options)
    assert (code, out) == (status, "")
    assert message in err.replace(str(tmp_path) + "/", "")
    assert files_in(tmp_path) == ["sheet.ply"]


@pytest.mark.parametrize(("options", "message"), [
    (("-o", "-"), "-: expected the ending"),
    (("-o", "a.npz", "-o", "a.npz"), "the same output is given twice"),
])  # fmt: skip
def test_levels_refuses_outputs_that_cannot_be(run, sheet, options, message):
    status, out, err = run("levels", sheet, "-n", 5, *options)
    assert (status, out) == (2, "")
    assert message in err


def test_levels_carries_attributes_over(run, sheet, tmp_path):
    mesh = read_mesh(sheet)
    attributes = sf.MeshAttributes(face={"part": np.arange(mesh.n_faces)})
    sf.write_mesh(tmp_path / "a.ply", mesh, np.zeros(mesh.n_faces, int), attributes=attributes)
    out = tmp_path / "b.ply"
    _, _, err = run("levels", tmp_path / "a.ply", "-n", 6, "-o", out)
    assert "in .ply, new values replace face properties label" in err
    kept = sf.read_attributes(tmp_path / "b.6.ply")
    assert np.array_equal(kept.face["part"], np.arange(mesh.n_faces))
    assert run("levels", tmp_path / "a.ply", "-n", 6, "-o", out, "--drop-attributes")[2] == ""
    assert "part" not in sf.read_attributes(tmp_path / "b.6.ply").face


def test_labels_with_gaps_are_merged(run, sheet, tmp_path):
    labels = segment(read_mesh(sheet), 30).labels
    write_labels(tmp_path / "gaps.npy", labels * 7 + 3)
    options = ("--labels", tmp_path / "gaps.npy", "-q")
    assert run("levels", sheet, "-n", 7, "-o", tmp_path / "a.seg", *options) == (0, "", "")
    expected = hierarchy(read_mesh(sheet), [7], labels=labels).levels[0]
    assert np.array_equal(read_labels(tmp_path / "a.7.seg"), expected)
