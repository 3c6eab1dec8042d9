"""The command `convert`, and formats that `segment` also writes."""

import json

import numpy as np
import pytest
import shapes
from command_line import can_render, files_in
from numpy.testing import assert_array_equal

import superfacets as sf
from superfacets import (
    MeshAttributes,
    PointCloud,
    Texture,
    read_attributes,
    read_labels,
    read_mesh,
    write_labels,
    write_mesh,
)
from superfacets_formats.las_frame import LasDimension, LasFrame
from superfacets_scans import regroup_segments
from superfacets_textures import Material

NO_LABELS = (
    "superfacets: error: a.ply: there are no labels (none called label): give a"
    " label file as LABELS, or the name of the labels with --labels-named\n"
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write a sheet of 72 faces, its labels in a.npy, and a copy that contains its own labels."""
    monkeypatch.chdir(tmp_path)
    sheet = shapes.bumpy_sheet(6)
    write_mesh("a.ply", sheet)
    write_labels("a.npy", np.arange(72) // 8)
    write_mesh("own.ply", sheet, np.arange(72) // 36)
    return tmp_path


def test_a_mesh_and_its_labels_are_written_in_other_formats(run, folder):
    outputs = ["a.obj", "a.off", "a.glb", "a.segs.json", "a.bin", "b_sp_label.npy", "a.sstk.json"]
    options = [text for name in outputs for text in ("-o", name)]
    status, printed, err = run("convert", "a.ply", "a.npy", *options)
    assert status == 0
    assert err == (
        "superfacets: note: 9 regions with fewer than 20 vertices in .bin and .segs.json and"
        " _sp_label.npy: no neighbor has vertices to spare, and regions are not merged\n"
    )
    ids = (".segs.json", ".bin", ".npy")
    wrote = [f"wrote {name}" + " (a label per vertex)" * name.endswith(ids) for name in outputs]
    assert printed.splitlines() == [*wrote, "a.ply: 72 faces"]
    assert {*outputs} <= {*files_in(folder)}
    assert read_mesh("a.obj").n_faces == 72
    assert json.loads((folder / "a.sstk.json").read_text())["elementCount"] == 72
    ids = json.loads((folder / "a.segs.json").read_text())["segIndices"]
    assert_array_equal(np.load("b_sp_label.npy"), ids)


def test_classes_that_lose_their_numbers_are_a_note(run, folder):
    write_labels("classes.npy", np.where(np.arange(72) < 36, 5, 40))
    err = run("convert", "a.ply", "classes.npy", "-o", "a.bin")[2]
    assert "gaps in .bin; .segs.json keeps the labels 5, 40" in err
    assert run("convert", "a.ply", "classes.npy", "-o", "a.segs.json")[2] == ""


@pytest.mark.parametrize("name", ["v.npy", "v.segs.json"])
def test_labels_of_vertices_become_labels_of_faces_by_majority(run, folder, name):
    mesh = read_mesh("a.ply")
    of_vertices = np.arange(mesh.n_vertices) // 20
    write_labels(name, of_vertices)
    assert run("convert", "a.ply", name, "-o", "b.npy")[0] == 0
    a, b, c = of_vertices[mesh.faces].T
    expected = np.select([(a == b) | (a == c), b == c], [a, b], np.minimum(np.minimum(a, b), c))
    assert len(np.unique(expected)) == 3
    assert_array_equal(read_labels("b.npy"), expected)
    regions = run("regions", "a.ply", "b.npy")[1]
    assert run("regions", "a.ply", name)[1] == regions
    assert run("view", "a.ply", "--labels", name, "--html", "v.html")[0] == 0
    if can_render():
        for labels, picture in ((name, "v.png"), ("b.npy", "b.png")):
            assert run("render", "a.ply", "--labels", labels, "-o", picture)[0] == 0
        assert (folder / "v.png").read_bytes() == (folder / "b.png").read_bytes()


def test_superpoints_without_a_face_are_nodes_of_graphs_and_left_out_of_tables(run, folder):
    ids = np.zeros(49, int)
    ids[24:], ids[0] = 2, 1  # the corner labeled 1 is never the majority
    write_labels("v.segs.json", ids)
    status, _, err = run("convert", "a.ply", "v.segs.json", "-o", "g.npz")
    assert (status, "note" in err) == (0, False)
    with np.load("g.npz") as graph:
        assert graph["region"].tolist() == [0, 1, 2]
        assert graph["vertex_super_index"].tolist() == ids.tolist()
        assert graph["edge_index"].tolist() == [[0, 0, 1, 2], [1, 2, 0, 0]]
    assert "1 region left out without a face" in run("regions", "a.ply", "v.segs.json")[2]
    ids[0] = 0
    write_labels("v.segs.json", ids)
    err = run("convert", "a.ply", "v.segs.json", "-o", "g.npz")[2]
    assert "numbered without gaps in .npz; the array region contains the label of each node" in err


def test_labels_of_vertices_stay_as_they_are_in_formats_with_one_label_per_vertex(run, folder):
    ids = np.random.default_rng(0).integers(0, 9, 49)
    write_labels("v.segs.json", ids)
    outputs = ["b.segs.json", "b.bin", "b.label.gii", "b.aggregation.json"]
    named = [word for name in outputs for word in ("-o", name)]
    status, printed, err = run("convert", "a.ply", "v.segs.json", *named, "--json")
    assert (status, "converted" in err) == (0, False)
    assert json.loads(printed)["n_labels"] == len(np.unique(ids))
    assert_array_equal(read_labels("b.segs.json"), ids)
    assert_array_equal(np.fromfile("b.bin", "<i8"), np.unique(ids, return_inverse=True)[1])
    assert_array_equal(read_labels("b.label.gii"), ids)
    text = (folder / "b.label.gii").read_text()
    (folder / "b.label.gii").write_text(text.replace("region_3", "cuneus"))
    err = run("convert", "a.ply", "b.label.gii", "-o", "b.annot")[2]
    assert "note: colors of areas are not copied from b.label.gii" in err
    assert b"cuneus\0" in (folder / "b.annot").read_bytes()
    groups = json.loads((folder / "b.aggregation.json").read_text())["segGroups"]
    assert [group["segments"] for group in groups] == [[i] for i in np.unique(ids)]
    args = ("convert", "a.ply", "v.segs.json", "-o", "c.segs.json", "-o", "c.npy")
    assert "v.segs.json: labels of vertices were converted to labels of faces" in run(*args)[2]
    assert_array_equal(read_labels("c.segs.json"), ids)
    assert len(read_labels("c.npy")) == 72
    assert run(*args, "-q")[2] == ""
    assert run(*args[:3], "--vertex-labels", "--ascii", "-o", "b.ply")[0] == 0
    assert_array_equal(read_attributes("b.ply").vertex["label"], ids)


def test_labels_of_vertices_that_a_format_cannot_store_are_refused(run, folder):
    np.save("v.npy", np.r_[np.zeros(48, int), -1])
    status, _, err = run("convert", "a.ply", "v.npy", "-o", "b.segs.json")
    assert (status, "labels[48] must be >= 0 in .segs.json, got -1" in err) == (1, True)


def test_labels_of_vertices_of_another_mesh_are_refused(run, folder):
    write_labels("v.segs.json", np.zeros(7, int))
    status, _, error = run("regions", "a.ply", "v.segs.json")
    assert status == 1
    assert "v.segs.json: labels must have one value per vertex (49), got 7 values" in error


def test_labels_in_the_mesh_are_used_where_none_are_named(run, folder):
    assert run("convert", "own.ply", "-o", "b.seg")[0] == 0
    assert_array_equal(read_labels("b.seg"), np.arange(72) // 36)
    assert run("convert", "own.ply", "a.npy", "-o", "c.seg")[0] == 0
    assert_array_equal(read_labels("c.seg"), np.arange(72) // 8)
    status, _, err = run("convert", "a.ply", "-o", "d.seg")
    assert (status, err) == (1, NO_LABELS)
    assert run("convert", "a.ply", "-o", "d.obj")[0] == 0
    assert "g " not in (folder / "d.obj").read_text()


def test_a_quiet_run_prints_nothing(run, folder):
    assert run("convert", "own.ply", "a.npy", "-o", "b.ply")[2].startswith("superfacets: note: ")
    assert run("convert", "own.ply", "a.npy", "-o", "c.ply", "-q") == (0, "", "")
    assert (folder / "c.ply").read_bytes() == (folder / "b.ply").read_bytes()


def test_options_of_labels_go_to_the_files(run, folder):
    pyvista = pytest.importorskip("pyvista")
    status, _, _ = run("convert", "a.ply", "a.npy", "-o", "b.vtp", "-o", "b.ply",
                       "--label-name", "Label", "--vertex-labels")  # fmt: skip
    assert status == 0
    assert_array_equal(pyvista.read("b.vtp").cell_data["Label"], np.arange(72) // 8)
    assert len(read_attributes("b.ply").vertex["label"]) == 49
    status, _, err = run("convert", "a.ply", "a.npy", "-o", "b.obj", "--label-name", "Label")
    assert status == 2
    assert "label_name needs an output with the ending .vtp or .vtu or .vtk" in err


def test_solids_of_split_regions_are_named_after_them(run, folder):
    options = ("--split", "parts", "--to", "stl", "--ascii")
    assert run("convert", "a.ply", "a.npy", *options)[0] == 0
    written = sorted((folder / "parts").glob("*.stl"))
    assert len(written) > 1
    for path in written:
        assert path.read_text().startswith(f"solid {path.stem}\n")


def test_parts_of_a_las_file_keep_its_fields_offsets_and_reference_system(run, tmp_path):
    laspy = pytest.importorskip("laspy")
    rng = np.random.default_rng(0)
    points = rng.random((30, 3)).round(2) + [500_000, 5_400_000, 100]
    dimension = LasDimension("tree id", "<u2", 1, "number of the tree")
    projection = ((2112, b"PROJCS[]\0"),)
    frame = LasFrame(4, 6, (0.01,) * 3, (4e5, 5e6, 0.0), projection, True, (dimension,))
    fields = {"classification": rng.choice([0, 2, 6], 30), "intensity": rng.integers(0, 999, 30)}
    attributes = MeshAttributes(vertex={**fields, "tree_id": np.arange(30)}, header=frame)
    write_mesh(tmp_path / "tile.las", PointCloud(points), attributes=attributes)
    split = ("--labels-named", "classification", "--split", tmp_path / "parts", "--to", "las")
    assert run("convert", tmp_path / "tile.las", *split)[::2] == (0, "")
    whole = laspy.read(tmp_path / "tile.las")
    for kind in (0, 2, 6):
        part = laspy.read(tmp_path / f"parts/region_{kind}.las")
        chosen = whole.points[whole.classification == kind]
        assert part.points.array.tobytes() == chosen.array.tobytes()
        assert part.header.scales.tolist() == whole.header.scales.tolist()
        assert part.header.offsets.tolist() == [4e5, 5e6, 0]
        (record,) = part.header.vlrs.get_by_id("LASF_Projection")
        assert (record.record_id, record.record_data_bytes()) == projection[0]
    assert run("convert", tmp_path / "tile.las", *split, "--drop-attributes")[0] == 0
    given = ("convert", tmp_path / "tile.las", "-o", tmp_path / "b.laz")
    assert "reference system" not in run(*given)[2]
    err = run(*given, "--drop-attributes")[2]
    assert "its reference system, scale and offset are dropped, too" in err
    assert not laspy.read(tmp_path / "parts/region_6.las").classification.any()


@pytest.mark.parametrize("ending", ["csv", "las", "pcd", "ply"])
def test_parts_of_a_cloud_keep_the_labels_of_the_input(run, tmp_path, ending):
    if ending == "las":
        pytest.importorskip("laspy")
    points, labels = np.random.default_rng(0).random((30, 3)), np.repeat([0, 2, 6], 10)
    write_mesh(tmp_path / "cloud.ply", PointCloud(points), labels)
    split = ("--split", tmp_path / "parts", "--to", ending)
    assert run("convert", tmp_path / "cloud.ply", *split)[::2] == (0, "")
    for label in (0, 2, 6):
        part = tmp_path / f"parts/region_{label}.{ending}"
        assert np.array_equal(read_labels(part), np.full(10, label))
    assert run("convert", tmp_path / "cloud.ply", *split, "--drop-attributes")[0] == 0
    with pytest.raises(sf.MeshError, match="no property label"):
        read_labels(part)


def test_parts_of_a_textured_mesh_have_no_texture_and_a_note(run, tmp_path):
    texture = Texture([[0, 0], [1, 0], [0, 1]], [0, 1, 2] * 72, [Material("red")], [0] * 72)
    attributes = MeshAttributes(texture=texture)
    write_mesh(tmp_path / "a.obj", shapes.bumpy_sheet(6), attributes=attributes)
    write_labels(tmp_path / "a.npy", np.arange(72) // 36)
    inputs = (tmp_path / "a.obj", tmp_path / "a.npy", "--split", tmp_path / "parts")
    note = f"superfacets: note: no texture in the files of {tmp_path / 'parts'}\n"
    assert run("convert", *inputs)[::2] == (0, note)
    assert run("convert", *inputs, "-q")[::2] == (0, "")
    assert read_attributes(tmp_path / "parts/region_1.ply").texture is None


def test_regions_are_split(run, folder):
    status, printed, _ = run("convert", "a.ply", "a.npy", "--split", "parts", "--to", "obj")
    assert (status, printed) == (0, "wrote 9 files in parts\na.ply: 72 faces\n")
    assert files_in(folder / "parts") == [f"region_{region}.obj" for region in range(9)]
    status, printed, _ = run("convert", "own.ply", "--split", "halves")
    assert (status, printed) == (0, "wrote 2 files in halves\nown.ply: 72 faces\n")
    assert read_mesh("halves/region_1.ply").n_faces == 36
    assert run("convert", "own.ply", "--split", "halves")[0] == 0  # replaces the files
    write_labels("many.npy", np.arange(72) // 6)
    status, printed, err = run("convert", "a.ply", "many.npy", "--split", "halves")
    assert (status, printed, err) == (
        1, "", "superfacets: error: halves already contains other region files, such as"
        " region_0.ply: give a new or empty folder\n",
    )  # fmt: skip
    assert files_in(folder / "halves") == ["region_0.ply", "region_1.ply"]
    (folder / "halves/region_0.npy").write_bytes((folder / "a.npy").read_bytes())
    before = (folder / "halves/region_0.ply").read_bytes()
    for inputs in (["halves/region_0.ply", "a.npy"], ["a.ply", "halves/region_0.npy"]):
        status, _, err = run("convert", *inputs, "--split", "./halves")
        assert status == 2
        assert "region_0" in err
        assert "--split could overwrite the input" in err
    assert (folder / "halves/region_0.ply").read_bytes() == before
    status, _, err = run("convert", "a.ply", "--split", "none")
    assert (status, err) == (1, NO_LABELS)
    assert not (folder / "none").exists()


def test_what_cannot_be_meant_is_refused(run, folder):
    before = files_in(folder)
    for arguments, message in (
        (["a.ply"], "give -o a file or a folder, or --split a folder"),
        (
            ["a.ply", "--split", "b", "--to", "ply", "--to", "obj"],
            "writes a single format: give --to only once",
        ),
        (["a.ply", "a.npy", "-o", "a.npy"], "a.npy: the output would overwrite the input"),
        (["a.ply", "a.npy", "-o", "a.ply"], "a.ply: the output would overwrite the input"),
        (["a.ply", "-o", "b.gltf"], "expected the ending .ply, .vtp"),
        (["a.ply", "a.npy", "-o", "b.npy", "--to", "seg"], "--to has no effect: the endings"),
    ):
        status, _, err = run("convert", *arguments)
        assert status == 2
        assert message in err
    assert files_in(folder) == before


def test_a_folder_and_standard_output_take_formats(run, folder):
    assert run("convert", "a.ply", "a.npy", "-o", "out/", "--to", "glb", "--to", "bin")[0] == 0
    assert files_in(folder / "out") == ["a.bin", "a.superfacets.glb"]
    status, printed, err = run("convert", "a.ply", "a.npy", "-o", "-", "--to", "seg")
    assert (status, err) == (0, "a.ply: 72 faces\n")
    assert printed == "".join(f"{face // 8}\n" for face in range(72))


def test_attributes_are_carried_over_with_a_note_on_what_is_not(run, folder):
    write_mesh("c.ply", shapes.bumpy_sheet(6), np.zeros(72, int))
    status, _, err = run("convert", "c.ply", "a.npy", "-o", "d.ply")
    assert status == 0
    assert "note: in .ply, new values replace face properties label" in err
    assert run("convert", "c.ply", "a.npy", "-o", "d.ply", "--drop-attributes")[2] == ""
    for labels, replaced in ((), False), (["a.npy"], True):  # groups are labels
        err = run("convert", "c.ply", *labels, "-o", "d.obj")[2]
        assert ".obj does not store: face properties quality" in err
        assert ("in .obj, new values replace face property label\n" in err) == replaced
    assert run("convert", "c.ply", "-o", "d.ply")[2] == ""  # the labels are those of the input


def test_files_are_named_as_their_readers_look_for_them(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mesh("scene0000_00_vh_clean_2.ply", shapes.bumpy_sheet(4))
    formats = ("segs.json", "aggregation.json", "sp_label.npy", "obj")
    options = [text for name in formats for text in ("--to", name)]
    assert run("segment", "scene0000_00_vh_clean_2.ply", "-n", 3, "-o", "out/", *options)[0] == 0
    assert files_in(tmp_path / "out") == [
        "scene0000_00.aggregation.json", "scene0000_00_sp_label.npy",
        "scene0000_00_vh_clean_2.0.010000.segs.json", "scene0000_00_vh_clean_2.superfacets.obj",
    ]  # fmt: skip


def test_a_graph_beside_segments_has_the_node_of_each_vertex(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_mesh("a.ply", shapes.bumpy_sheet(24))
    assert run("segment", "a.ply", "-n", 9, "-o", "a.segs.json", "-o", "a.npz")[0] == 0
    segments = sf.read_labels("a.segs.json")
    assert np.load("a.npz")["vertex_super_index"].tolist() == segments.tolist()
    sf.write_labels("b.segs.json", segments * 3 + 5)
    assert run("convert", "a.ply", "b.segs.json", "-o", "b.npz")[0] == 0
    with np.load("b.npz") as file:
        assert file["vertex_super_index"].tolist() == segments.tolist()
        assert len(file["x"]) == 9


def test_groups_name_the_segments_that_are_written_with_them(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, n in (("office.ply", 9), ("s_vh_clean_2.ply", 9), ("tiny.ply", 32)):
        sheet = shapes.bumpy_sheet(24 if n == 9 else 4)  # tiny: 32 faces, 25 vertices
        write_mesh(name, sheet)
        formats = ("--to", "segs.json", "--to", "aggregation.json")
        assert run("segment", name, "-n", n, "-o", "out/", *formats)[0] == 0
        scene = name.removesuffix(".ply").removesuffix("_vh_clean_2")
        groups = tmp_path / "out" / f"{scene}.aggregation.json"
        segments = groups.with_name(f"{name.removesuffix('.ply')}.0.010000.segs.json")
        assert json.loads(groups.read_text())["segmentsFile"] == f"scannet.{segments.name}"
        moved = regroup_segments(f"{scene}.aggregation.json", groups, segments)
        assert {(found.n_lost, found.n_gained) for found in moved} == {(0, 0)}
        assert sum(found.n_vertices for found in moved) == sheet.n_vertices


def test_regions_below_the_minimum_of_vertices_are_a_note(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sheet = shapes.bumpy_sheet(24)
    write_mesh("a.ply", sheet)
    err = run("segment", "a.ply", "-n", 4, "-o", "a.segs.json", "-o", "a.npy")[2]
    assert "fewer than 20" not in err
    assert "minimum of 20" not in err
    err = run("segment", "a.ply", "-n", 42, "-o", "a.segs.json")[2]
    sizes = np.bincount(read_labels("a.segs.json"))
    n_small = np.count_nonzero(sizes < 20)
    assert 1 < n_small < len(sizes) == 42
    assert f"note: {n_small} regions with fewer than 20 vertices in .segs.json: no " in err
    n_filled = np.count_nonzero(sizes == 20)
    assert n_filled > 8
    assert f"note: {n_filled} of 42 regions in .segs.json have the minimum of 20 vertices" in err
    assert err.count("less accurate: try a smaller -n, or --features color if the file") == 1
    err = run("segment", "a.ply", "-r", 0.09, "-o", "a.segs.json", "--features", "height")[2]
    assert "less accurate: try a larger -r\n" in err
    # Given vertex labels are written unchanged, so the minimum number of vertices does not apply.
    assert run("convert", "a.ply", "a.segs.json", "-o", "b.segs.json")[2] == ""
    write_mesh("cloud.ply", PointCloud(sheet.vertices))
    write_labels("points.npy", np.arange(sheet.n_vertices) // 5)
    assert run("convert", "cloud.ply", "points.npy", "-o", "c.segs.json")[2] == ""


def test_regions_without_a_vertex_are_a_note(run, folder):
    write_mesh("cube.ply", shapes.cube())
    write_labels("b.npy", np.arange(12))  # labels of 12 faces, but only 8 vertices
    status, _, err = run("convert", "cube.ply", "b.npy", "-o", "b.segs.json", "-o", "b.bin")
    assert status == 0
    assert err == (
        "superfacets: note: 4 regions lost in .bin and .segs.json: all their vertices have"
        " labels of other regions\n"
        "superfacets: note: 8 regions with fewer than 20 vertices in .bin and .segs.json: no"
        " neighbor has vertices to spare, and regions are not merged\n"
        "superfacets: note: labels are renumbered without gaps in .bin; .segs.json keeps the labels"
        " 0, 1, 2, ...\n"
    )
    labels = np.zeros(72, int)
    labels[[10, 40]] = 1, 2  # single faces amid others get a vertex
    write_labels("b.npy", labels)
    status, _, err = run("convert", "a.ply", "b.npy", "-o", "b.segs.json")
    assert (status, "lost" in err) == (0, False)
    assert {*json.loads((folder / "b.segs.json").read_text())["segIndices"]} == {0, 1, 2}


def test_labels_of_vertices_are_those_of_the_input_that_was_subdivided(run, folder):
    status, _, _ = run("segment", "a.ply", "-n", 4, "--max-edge", 0.05, "-o", "b.segs.json",
                       "-o", "b.sstk.json", "-o", "b.ply")  # fmt: skip
    assert status == 0
    assert len(json.loads((folder / "b.segs.json").read_text())["segIndices"]) == 49
    assert json.loads((folder / "b.sstk.json").read_text())["elementCount"] == 72
    assert read_mesh("b.ply").n_faces > 72


def test_the_facts_are_printed_as_json(run, folder):
    status, printed, _ = run("convert", "a.ply", "a.npy", "--json", "--split", "d")
    assert status == 0
    parts, facts = [f"d/region_{region}.ply" for region in range(9)], {"file": "a.ply"}
    assert json.loads(printed) == facts | {"n_faces": 72, "n_labels": 9, "outputs": parts}
    printed = run("convert", "a.ply", "-o", "c.obj", "--json", "-q")[1]
    assert json.loads(printed) == facts | {"n_faces": 72, "n_labels": None, "outputs": ["c.obj"]}


def test_all_meshes_of_a_folder_are_converted(run, folder):
    (folder / "in").mkdir()
    for name in ("one.ply", "two.ply"):
        write_mesh(folder / "in" / name, shapes.bumpy_sheet(6), np.arange(72) // 36)
    (folder / "in" / "bad.ply").write_bytes(b"junk")
    status, printed, err = run("convert", "in", "-o", "out/", "--to", "obj", "--to", "npy")
    assert status == 1
    assert "bad.ply: not a PLY file" in err
    assert err.endswith("superfacets: error: 1 of 3 files failed\n")
    names = ["one.superfacets.npy", "one.superfacets.obj"]
    names += ["two.superfacets.npy", "two.superfacets.obj"]
    assert files_in(folder / "out") == names
    assert len(printed.splitlines()) == 6
    assert_array_equal(np.load(folder / "out" / "two.superfacets.npy"), np.arange(72) // 36)


@pytest.mark.parametrize(("arguments", "message"), [
    (["own.ply.d", "a.npy", "-o", "x/"], "LABELS and --split need a single mesh"),
    (["own.ply.d", "--split", "x"], "LABELS and --split need a single mesh"),
    (["own.ply.d", "-o", "x.obj"], "x.obj is one file for 2 inputs: give -o a folder"),
])  # fmt: skip
def test_a_folder_is_converted_to_a_folder(run, folder, arguments, message):
    (folder / "own.ply.d").mkdir()
    for name in ("one.ply", "two.ply"):
        write_mesh(folder / "own.ply.d" / name, shapes.bumpy_sheet(6))
    status, _, err = run("convert", *arguments)
    assert (status, message in err) == (2, True)
