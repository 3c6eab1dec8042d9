"""The command `regions`."""

import csv
import json
import subprocess
from importlib.util import find_spec

import numpy as np
import pytest
import shapes
from command_line import COMMAND, files_in

from superfacets import Mesh, MeshAttributes, PointCloud, write_labels, write_mesh

FOLD = shapes.fold(90)


@pytest.fixture
def fold(tmp_path):
    """Write two triangles of area 3 at a right angle, in regions 3 and 7."""
    write_mesh(tmp_path / "fold.ply", FOLD)
    (tmp_path / "labels.seg").write_text("3\n7\n")
    return tmp_path


def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


def test_the_table_is_printed_with_the_numbers_of_the_file(run, fold):
    status, printed, notes = run("regions", fold / "fold.ply", fold / "labels.seg")
    assert status == 0
    rows = rows_of(printed)
    assert [row["region"] for row in rows] == ["3", "7"]
    assert [float(row["area"]) for row in rows] == [3, 3]
    assert [float(row["normal_z"]) for row in rows] == pytest.approx([1, 0], abs=1e-9)
    assert notes == "fold.ply: 2 regions, 1 pair of neighbors\n"


def test_the_labels_in_the_mesh_are_used_without_labels(run, fold):
    write_mesh(fold / "labeled.ply", FOLD, [7, 3])
    status, printed, notes = run("regions", fold / "labeled.ply")
    assert status == 0
    found = [(row["region"], float(row["normal_z"]) > 0.5) for row in rows_of(printed)]
    assert found == [("3", False), ("7", True)]
    status, printed, notes = run("regions", fold / "fold.ply")
    assert (status, printed) == (1, "")
    assert notes.endswith("fold.ply has no labels: give a label file as LABELS\n")
    own = MeshAttributes(face={"part": [1, 2], "size": [0.5, 2]}, vertex={"n": range(4)})
    write_mesh(fold / "own.ply", FOLD, attributes=own)
    assert run("regions", fold / "own.ply")[2].endswith("or --labels-named with one of part\n")
    advice = ": superfacets levels -o OUT.npy writes a file per level, and view shows .npz"
    assert advice in run("regions", fold / "fold.ply", "a.npz")[2]


def test_labels_of_the_input_do_not_fit_a_file_sorted_by_region(run, fold):
    write_mesh(fold / "s.ply", shapes.bumpy_sheet(12))
    output, given = ["-n", 9, "-o", fold / "l.npy"], (fold / "s.stl", fold / "l.npy")
    assert "store: the order of faces" in run("segment", fold / "s.ply", *output, "-o", given[0])[2]
    assert f"{given[0]} are sorted by region" in run("regions", *given)[2]
    assert (run("segment", given[0], *output)[0], run("regions", *given)[0]) == (0, 0)  # its own


def write_table(path, names, *columns):
    """Write 90 points in regions -1, 2 and 5, with these columns."""
    points = np.random.default_rng(0).random((90, 3))
    rows = np.column_stack([points, np.repeat([-1, 2, 5], 30), *columns])
    np.savetxt(path, rows, delimiter=",", header=f"x,y,z,label,{names}", comments="")


def test_a_column_has_the_most_frequent_value_of_each_region(run, tmp_path):
    path = tmp_path / "cloud.csv"
    kinds = np.concatenate([np.full(30, 9), np.arange(30) % 3, np.where(np.arange(30) < 20, 6, 2)])
    write_table(path, "kind,even", kinds, 1 - kinds % 2)
    status, printed, _ = run("regions", path, "--majority", "kind", "--majority", "even")
    assert status == 0
    names = "region", "majority_kind", "majority_even"
    rows = [tuple(row[name] for name in names) for row in rows_of(printed)]
    assert rows == [("2", "0", "1"), ("5", "6", "1")]
    status, _, notes = run("regions", path, "--majority", "height")
    assert status == 1
    assert "cloud.csv: the points have no property height: the integer properties are" in notes
    assert notes.endswith(" label, kind, even\n")
    command = [*COMMAND, "regions", "-", "--format", "csv", "--majority", "kind"]
    piped = subprocess.run(command, input=path.read_bytes(), capture_output=True, check=True)
    assert [row["majority_kind"] for row in rows_of(piped.stdout.decode())] == ["0", "6"]


def test_a_format_without_integers_of_the_cells_is_refused(run, fold):
    write_mesh(fold / "fold.off", FOLD)
    status, _, notes = run("regions", fold / "fold.off", fold / "labels.seg", "--majority", "kind")
    assert status == 1
    assert notes.endswith("fold.off: the faces have no property kind\n")


def test_a_column_has_the_mean_of_a_property_in_each_region(run, tmp_path):
    path = tmp_path / "cloud.csv"
    write_table(path, "intensity,low", np.arange(90) / 2, np.arange(90) / -2)
    status, printed, _ = run("regions", path, "--mean", "intensity", "--mean", "low")
    assert status == 0
    rows = [(float(row["mean_intensity"]), float(row["mean_low"])) for row in rows_of(printed)]
    assert rows == [(22.25, -22.25), (37.25, -37.25)]
    status, _, notes = run("regions", path, "--mean", "height")
    assert status == 1
    assert "cloud.csv has no property height: the properties are label, intensity, low\n" in notes


def test_a_mean_over_faces_needs_one_number_per_face(run, fold):
    attributes = MeshAttributes(
        vertex={"height": np.arange(FOLD.n_vertices)},
        face={"heat (K/m)": np.arange(FOLD.n_faces), "wide": np.ones((FOLD.n_faces, 2))},
    )
    write_mesh(fold / "heat.vtp", FOLD, attributes=attributes)
    given = (fold / "heat.vtp", fold / "labels.seg")
    labels = np.loadtxt(fold / "labels.seg", dtype=int)
    status, printed, _ = run("regions", *given, "--mean", "heat (K/m)", "--mean", "height")
    assert status == 0
    heights = FOLD.faces.mean(axis=1)
    for row in rows_of(printed):
        members = labels == int(row["region"])
        assert float(row["mean_heat (K/m)"]) == np.flatnonzero(members).mean()
        assert float(row["mean_height"]) == pytest.approx(heights[members].mean())
    status, _, notes = run("regions", *given, "--mean", "wide")
    assert status == 1
    assert "wide has 2 numbers per row, but one is needed" in notes
    status, _, notes = run("regions", fold / "fold.ply", fold / "labels.seg", "--mean", "heat")
    assert status == 1
    assert "fold.ply has no property heat: it has no properties" in notes


def test_labels_and_a_property_of_vertices_are_averaged_at_the_vertices(run, fold):
    heights, labels = np.arange(FOLD.n_vertices), np.arange(FOLD.n_vertices) // 3
    write_mesh(fold / "heat.ply", FOLD, attributes=MeshAttributes(vertex={"height": heights}))
    np.save(fold / "of_vertices.npy", labels)
    means = f"height,{fold}/v.npy,{fold}/./v.npy"
    given = (fold / "heat.ply", fold / "of_vertices.npy", "--mean", means)
    np.save(fold / "v.npy", heights * 1.0)
    _, printed, notes = run("regions", *given, "--majority", "height")
    rows = rows_of(printed) if "pooled over vertices, by the labels of vertices" in notes else ()
    assert rows
    for row in rows:
        members = labels == int(row["region"])
        assert float(row["mean_height"]) == heights[members].mean()
        assert row["mean_v.npy"] == row[f"mean_{fold}/./v.npy"] == row["mean_height"]
        assert int(row["majority_height"]) == heights[members].min()
    given = (given[0], fold / "labels.seg", "--majority", "height", "--majority")
    for file, expected in (("labels.seg", ["3", "7"]), ("of_vertices.npy", ["0", "0"])):
        rows = rows_of(run("regions", *given, fold / file)[1])
        assert [row["majority_height"] for row in rows] == ["0", "0"]
        assert [row[f"majority_{file}"] for row in rows] == expected


def test_a_property_of_faces_is_averaged_over_faces_if_there_are_as_many_vertices(run, tmp_path):
    tetrahedron = np.eye(4)[:, :3], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    heat = MeshAttributes(face={"heat": np.arange(4)})
    write_mesh(tmp_path / "heat.ply", tetrahedron, attributes=heat)
    (tmp_path / "of_vertices.segs.json").write_text('{"segIndices": [0, 0, 0, 1]}')
    given = (tmp_path / "heat.ply", tmp_path / "of_vertices.segs.json", "--mean", "heat")
    assert [row["mean_heat"] for row in rows_of(run("regions", *given)[1])] == ["1.5"]


@pytest.mark.parametrize(("ending", "noun"), [("stl", "solid"), ("obj", "group")])
def test_parts_in_another_order_than_the_faces_are_refused(run, fold, ending, noun):
    parts = fold / f"parts.{ending}"
    write_mesh(parts, FOLD, [7, 3])  # sorted by region, which swaps the faces
    status, printed, notes = run("regions", fold / "fold.ply", parts)
    assert (status, printed) == (1, "")
    assert notes.startswith(f"superfacets: error: {parts}: the faces or their order differ from")
    assert run("regions", parts, parts)[0] == 0
    write_mesh(parts, FOLD, [3, 7])  # regions in the order of the mesh
    assert run("regions", fold / "fold.ply", parts)[0] == 0
    write_mesh(parts, FOLD, [3, 7], classes=["lid", "box"])
    rows = rows_of(run("regions", parts, fold / "labels.seg", "--majority", noun)[1])
    assert [row[f"majority_{noun}_name"] for row in rows] == ["lid", "box"]
    write_labels(areas := fold / "a.annot", [0, 0, 0, 0])
    rows = rows_of(run("regions", fold / "fold.ply", areas, "--majority", areas)[1])
    assert rows[0]["name"] == rows[0]["majority_a.annot_name"] == "region_0"


@pytest.mark.parametrize("ending", ["ply", "csv"])
def test_labels_at_other_positions_are_refused(run, tmp_path, ending):
    points = np.random.default_rng(0).random((90, 3)) * [100, 100, 9] + [5e5, 5.4e6, 0]
    first, second, rounded = (tmp_path / f"{name}.{ending}" for name in ("a", "b", "rounded"))
    write_mesh(first, PointCloud(points), np.repeat([0, 1], 45))
    write_mesh(second, PointCloud(points + [100, 0, 0]), np.repeat([1, 0], 45))
    write_mesh(rounded, PointCloud(points.astype(np.float32)), np.repeat([1, 0], 45))
    table = tmp_path / "both.csv"
    message = (
        f"superfacets: error: {second}: the points or their order differ from the input, so the"
        f" labels do not fit: use b.{ending} as the input, or give labels as .npy\n"
    )
    for name, output in (("regions", table), ("convert", tmp_path / "c.ply")):
        assert run(name, first, second, "-o", output)[::2] == (1, message)
        assert not output.exists()
    assert run("regions", first, rounded, "-o", table)[0] == 0


def test_labels_of_other_vertices_are_refused(run, tmp_path):
    mesh = shapes.bumpy_sheet(6)
    write_mesh(tmp_path / "mesh.ply", mesh)
    labels, found = np.arange(mesh.n_vertices) // 9, tmp_path / "found.npy"
    write_mesh(tmp_path / "same.ply", PointCloud(mesh.vertices), labels)
    assert run("convert", tmp_path / "mesh.ply", tmp_path / "same.ply", "-o", found, "-q")[0] == 0
    found.unlink()
    other = tmp_path / "other.ply"
    for points in (mesh.vertices[::-1], mesh.vertices * 5, mesh.vertices + [0.01, 0, 0]):
        write_mesh(other, PointCloud(points), labels)
        assert run("convert", tmp_path / "mesh.ply", other, "-o", found)[::2] == (
            1, f"superfacets: error: {other}: the vertices or their order differ from the input, so"
            " the labels do not fit: use other.ply as the input, or give labels as .npy\n",
        )  # fmt: skip
        assert not found.exists()


def test_swapped_neighbors_are_refused_but_rounding_is_not(run, tmp_path):
    ticks = np.arange(0, 10_000, 0.6)  # a profile of 10 km
    points = np.stack([ticks, 10_000 - ticks, np.sin(ticks)], axis=1)[:16_000]
    write_mesh(tmp_path / "given.csv", PointCloud(points))
    swapped = points.reshape(-1, 2, 3)[:, ::-1].reshape(-1, 3)
    step = 2.0**-24 * 10_000  # maximum error of rounding to float32
    for moved, expected in (
        (swapped, 1),
        (points + [0, 0, 0.001], 1),  # the heights are small, so their rounding is, too
        (points + [3 * step, 0, 0], 1),
        (points + [step, -step, 0], 0),
        (points.astype(np.float32), 0),
    ):
        write_mesh(tmp_path / "moved.csv", PointCloud(moved), np.arange(16_000) // 4_000)
        files = tmp_path / "given.csv", tmp_path / "moved.csv"
        assert run("convert", *files, "-o", tmp_path / "found.npy")[0] == expected


@pytest.mark.parametrize("kind", ["faces", "points"])
@pytest.mark.parametrize("far", [0, 5.4e6])
def test_labels_in_the_formats_that_are_written_fit_their_own_source(run, tmp_path, kind, far):
    mesh = shapes.bumpy_sheet(6)
    corners = mesh.vertices / 3 + [far / 10, far, 0]  # not exact in float32
    if kind == "faces":
        source, endings = Mesh(corners, mesh.faces), ["ply", "obj", "stl", "vtp"]
    else:
        source, endings = PointCloud(corners), ["ply", "csv", "pcd"]
        endings += ["las"] * bool(find_spec("laspy"))
    labels = np.arange(source.n_cells) // 9
    first, found = tmp_path / "source.ply", tmp_path / "found.npy"
    write_mesh(first, source)
    for ending in endings:
        for options in ({}, {"ascii": True}) if ending in ("ply", "pcd", "vtp") else ({},):
            labeled = tmp_path / f"labeled.{ending}"
            write_mesh(labeled, source, labels, **options)
            for files in ((first, labeled), (labeled, labeled), (labeled, first)):
                write_mesh(first, source, labels)
                assert run("convert", *files, "-o", found)[::2] == (0, ""), files
                assert np.array_equal(np.load(found), labels)


def test_tables_and_borders_are_written(run, fold):
    regions, arcs, borders = fold / "regions.json", fold / "arcs.csv", fold / "borders.obj"
    status, printed, _ = run(
        "regions", fold / "fold.ply", fold / "labels.seg", "-o", regions, "--arcs", arcs,
        "--borders", borders,
    )  # fmt: skip
    assert status == 0
    assert printed.splitlines()[:3] == [f"wrote {path}" for path in (regions, arcs, borders)]
    table = json.loads(regions.read_text())
    assert [row["center"] for row in table] == [0, 1]
    [arc] = rows_of(arcs.read_text())
    assert (arc["low"], arc["high"], float(arc["border_length"])) == ("3", "7", 2)
    assert float(arc["concavity"]) == pytest.approx(np.pi / 2)
    lines = borders.read_text().splitlines()
    names = [line for line in lines if line[0] == "g"]
    assert sorted(names) == ["g border_3_7", "g border_3_open", "g border_7_open"]
    points = [line.split()[1:] for line in lines if line[0] == "v"]
    along = [line.split()[1:] for line in lines if line[0] == "l"]
    assert len(points) == 4
    between = along[names.index("g border_3_7")]
    ends = [np.array(points[int(v) - 1], float) for v in between]
    assert {tuple(end) for end in ends} == {(0, 0, 0), (0, 2, 0)}
    assert sorted(map(len, along)) == [2, 3, 3]


def test_borders_for_paraview_have_the_regions_on_both_sides(run, fold):
    pyvista = pytest.importorskip("pyvista")
    borders = fold / "borders.vtp"
    assert run("regions", fold / "fold.ply", fold / "labels.seg", "--borders", borders)[0] == 0
    lines = pyvista.read(borders)
    regions = zip(lines.cell_data["low"].tolist(), lines.cell_data["high"].tolist(), strict=True)
    assert sorted(regions) == [(3, -1), (3, 7), (7, -1)]
    assert lines.compute_cell_sizes().cell_data["Length"].min() == pytest.approx(2)


def test_a_closed_border_ends_where_it_begins(run, tmp_path):
    write_mesh(tmp_path / "cube.ply", shapes.cube())
    (tmp_path / "labels.txt").write_text("0\n0\n" + "1\n" * 10)
    borders = tmp_path / "borders.obj"
    run("regions", tmp_path / "cube.ply", tmp_path / "labels.txt", "--borders", borders)
    [line] = [line for line in borders.read_text().splitlines() if line[0] == "l"]
    vertices = line.split()[1:]
    assert len(vertices) == 5
    assert vertices[0] == vertices[-1]


def test_what_is_not_there_is_empty_or_null(run, tmp_path):
    write_mesh(tmp_path / "cube.ply", shapes.cube())  # closed: no normal
    (tmp_path / "labels.txt").write_text("0\n" * 12)
    given = (tmp_path / "cube.ply", tmp_path / "labels.txt")
    [row] = rows_of(run("regions", *given)[1])
    assert row["normal_x"] == ""
    run("regions", *given, "-o", tmp_path / "table.json", "--arcs", tmp_path / "arcs.json")
    [row] = json.loads((tmp_path / "table.json").read_text())
    assert row["normal_x"] is None
    assert json.loads((tmp_path / "arcs.json").read_text()) == []


def test_a_cloud_has_regions_and_no_lines(run, tmp_path):
    np.save(tmp_path / "cloud.npy", np.random.default_rng(0).uniform(size=(50, 3)))
    (tmp_path / "labels.txt").write_text("0\n1\n" * 25)
    given = (tmp_path / "cloud.npy", tmp_path / "labels.txt")
    assert len(rows_of(run("regions", *given)[1])) == 2
    status, _, error = run("regions", *given, "--borders", tmp_path / "borders.obj")
    assert status == 2
    assert "--borders needs a mesh with faces" in error


@pytest.mark.parametrize("side", [-1, 1])
def test_normals_of_regions_face_the_viewpoint(run, fold, side):
    np.save(fold / "cloud.npy", np.random.default_rng(0).random((90, 3)) * [1, 1, 0])
    (fold / "many.seg").write_text("0\n1\n" * 45)
    view = ("--viewpoint", f"0.5,0.5,{9 * side}")
    status, printed, _ = run("regions", fold / "cloud.npy", fold / "many.seg", *view)
    assert status == 0
    assert [float(row["normal_z"]) for row in rows_of(printed)] == pytest.approx([side, side])
    status, _, error = run("regions", fold / "fold.ply", fold / "labels.seg", *view)
    assert status == 1
    assert "omit viewpoint: it is only for point clouds without normals" in error


def test_wrong_outputs_are_refused_before_anything_is_read(run, tmp_path):
    given = ("regions", "none.ply", "none.seg")
    for option, name in [("-o", "table.xls"), ("--arcs", "arcs"), ("--borders", "lines.ply")]:
        status, _, error = run(*given, option, name)
        assert status == 2
        assert "expected the ending" in error
    status, _, error = run(*given, "-o", "table.csv", "--arcs", "table.csv")
    assert status == 2
    assert "the same output is given twice" in error


def test_labels_of_another_mesh_are_refused(run, fold):
    (fold / "short.seg").write_text("0\n")
    status, _, error = run("regions", fold / "fold.ply", fold / "short.seg")
    assert status == 1
    assert "labels must have one value per face (2) or per vertex (4), got 1 value" in error


def test_no_input_is_replaced(run, fold, monkeypatch):
    monkeypatch.chdir(fold)
    np.save("cloud.npy", np.random.default_rng(0).uniform(size=(50, 3)))
    np.savetxt("cloud.csv", np.load("cloud.npy"), delimiter=",")
    (fold / "many.seg").write_text("0\n1\n" * 25)
    write_mesh("fold.obj", FOLD)
    (fold / "l.csv").symlink_to("labels.seg")
    before = {path.name: path.read_bytes() for path in fold.iterdir()}
    for given in [
        ("cloud.csv", "many.seg", "-o", "cloud.csv"),
        ("cloud.csv", "many.seg", "--arcs", "./cloud.csv"),
        ("fold.obj", "labels.seg", "--borders", fold / "fold.obj"),
        ("fold.obj", "labels.seg", "-o", "l.csv"),
    ]:
        status, _, err = run("regions", *given)
        assert status == 2
        assert "the output would overwrite the input" in err
    assert {path.name: path.read_bytes() for path in fold.iterdir()} == before


def test_folders_that_are_missing_are_found_before_anything_is_read(run, tmp_path):
    for option, name in [("-o", "no/t.csv"), ("--arcs", "no/t.csv"), ("--borders", "no/b.obj")]:
        status, _, err = run("regions", "none.ply", "none.seg", option, tmp_path / name)
        assert status == 1
        assert f"the folder {tmp_path / 'no'} does not exist" in err


def test_no_table_is_written_where_the_borders_fail(run, fold, broken):
    broken("superfacets_cli.regions.border_lines", ZeroDivisionError)
    given = ("-o", fold / "t.csv", "--borders", fold / "b.obj")
    with pytest.raises(ZeroDivisionError):
        run("regions", fold / "fold.ply", fold / "labels.seg", *given)
    assert files_in(fold) == ["fold.ply", "labels.seg"]


def test_a_quiet_run_prints_the_table_alone(run, fold):
    given = ("regions", fold / "fold.ply", fold / "labels.seg", "-q")
    _, printed, notes = run(*given)
    assert (len(rows_of(printed)), notes) == (2, "")
    assert run(*given, "-o", fold / "t.csv") == (0, "", "")
    assert (fold / "t.csv").read_text() == printed


def test_faces_in_no_region_have_no_row_and_no_name(run, fold):
    (fold / "labels.seg").write_text("-1\n7\n")
    borders = fold / "borders.obj"
    files = (fold / "fold.ply", fold / "labels.seg")
    status, printed, notes = run("regions", *files, "--borders", borders)
    assert status == 0
    assert [(row["region"], float(row["area"])) for row in rows_of(printed)] == [("7", 3)]
    assert notes.endswith("1 region, 0 pairs of neighbors\n")
    names = [line for line in borders.read_text().splitlines() if line[0] == "g"]
    assert {*names} == {"g border_7_open"}
    (fold / "labels.seg").write_text("-1\n-1\n")
    status, _, error = run("regions", *files)
    assert status == 1
    assert error.endswith("labels.seg: no cell is in a region: all labels are -1\n")


def test_a_closed_standard_output_is_one_line(run, fold, monkeypatch):
    monkeypatch.setattr("sys.stdout", None)
    status, _, error = run("regions", fold / "fold.ply", fold / "labels.seg")
    assert status == 1
    assert "standard output is closed" in error


def test_a_minus_is_standard_output(run, fold):
    arguments = ("regions", fold / "fold.ply", fold / "labels.seg")
    assert run(*arguments, "-o", "-") == run(*arguments)
    assert "-" not in files_in(fold)


def test_the_facts_are_printed_as_json(run, fold):
    arguments = ("regions", fold / "fold.ply", fold / "labels.seg", "--json")
    expected = {"file": str(fold / "fold.ply"), "n_regions": 2, "n_pairs": 1}
    status, printed, notes = run(*arguments)
    assert (status, len(rows_of(printed))) == (0, 2)
    assert json.loads(notes) == {**expected, "outputs": ["-"]}
    out = str(fold / "regions.csv")
    status, printed, notes = run(*arguments, "-o", out)
    assert (status, notes) == (0, "")
    assert json.loads(printed) == {**expected, "outputs": [out]}


def test_labels_of_another_name_are_measured(run, fold):
    attributes = MeshAttributes(face={"part": [3, 7]})
    write_mesh(fold / "own.ply", FOLD, attributes=attributes)
    named = run("regions", fold / "own.ply", fold / "own.ply", "--labels-named", "part", "-q")
    assert named == run("regions", fold / "fold.ply", fold / "labels.seg", "-q")
