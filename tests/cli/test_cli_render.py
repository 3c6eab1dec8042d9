"""The command `render`."""

import numpy as np
import pytest
import shapes
from command_line import can_render

from superfacets import (
    MeshAttributes,
    Plot,
    PointCloud,
    face_colors,
    read_mesh,
    write_labels,
    write_mesh,
)


def test_labels_in_a_mesh_file_that_are_wrong_are_not_passed_over(run, tmp_path):
    path = tmp_path / "mesh.ply"
    write_mesh(path, shapes.strip(2), [0, 1], ascii=True)
    *head, last = path.read_text().splitlines()
    count, a, b, c, label, *rest = last.split()
    assert label == "1"
    path.write_text("\n".join([*head, " ".join([count, a, b, c, "-4", *rest]), ""]))
    status, _, err = run("render", path, "-o", tmp_path / "picture.png")
    assert status == 1
    assert "labels[1] must be -1 to 2147483647, got -4" in err


def test_a_mesh_is_drawn_with_its_labels(run, sheet, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    plain, labeled, given = (tmp_path / f"{name}.png" for name in ("plain", "labeled", "given"))
    both = ["-o", tmp_path / "l.ply", "-o", tmp_path / "l.npy"]
    assert run("segment", sheet, "-n", 20, *both)[0] == 0
    assert run("render", sheet, "-o", plain) == (
        0,
        f"wrote {plain} (up: y, guessed; change it with --up)\n",
        f"superfacets: note: {sheet} has no labels, so no regions are drawn: give"
        " a label file as LABELS\n",
    )
    assert run("render", tmp_path / "l.ply", "-o", labeled)[::2] == (0, "")
    assert run("render", sheet, "--labels", tmp_path / "l.npy", "-o", given)[0] == 0
    assert labeled.read_bytes() == given.read_bytes() != plain.read_bytes()
    turned = tmp_path / "turned.png"
    view = ["--up", "z", "--azimuth", "-40", "--elevation", "50"]
    assert run("render", tmp_path / "l.ply", "-o", turned, *view)[0] == 0
    assert turned.read_bytes() != labeled.read_bytes()


@pytest.fixture
def labeled(sheet, tmp_path):
    """Write labels of 4 and of 2 regions of the sheet."""
    paths = tmp_path / "four.npy", tmp_path / "two.npy"
    for path, n in zip(paths, (4, 2), strict=True):
        np.save(path, np.arange(1152) * n // 1152)
    return paths


def size_of(path):
    from PIL import Image

    with Image.open(path) as image:
        return image.size, getattr(image, "n_frames", 1)


def test_pictures_of_a_side_with_values_and_side_by_side(run, sheet, labeled, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    path, values = tmp_path / "picture.png", tmp_path / "values.txt"
    values.write_text("\n".join(map(str, range(1152))))
    four, two = labeled
    picture = ["render", sheet, "-o", path, "--size", "160x120"]
    both = ["--compare", four, "--compare", two]
    seen = []
    for more, width in [
        (both, 320), (["--labels", four, "--compare", two, "--color-by", values], 320),
        (["--labels", four, "--color-by", "area"], 160), (["--labels", four, "--numbers"], 160),
        (["--labels", four, "--view", "top", "--up", "z"], 160),
        (["--labels", four, "--azimuth", 0, "--elevation", 90, "--up", "z"], 160),
    ]:  # fmt: skip
        guess = "" if "--up" in more else " (up: y, guessed; change it with --up)"
        assert run(*picture, *more) == (0, f"wrote {path}{guess}\n", "")
        assert size_of(path) == ((width, 120), 1)
        seen.append(path.read_bytes())
    assert len(set(seen)) == 5
    assert seen[4] == seen[5]


def test_labels_in_the_mesh_are_compared_with_others(run, sheet, labeled, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    own, path = tmp_path / "own.ply", tmp_path / "picture.png"
    write_mesh(own, read_mesh(sheet), np.load(labeled[0]))
    picture = ["-o", path, "--size", "160x120", "--compare", labeled[1]]
    assert run("render", own, *picture)[0] == 0
    assert size_of(path) == ((320, 120), 1)
    seen = path.read_bytes()
    assert run("render", own, "--labels", own, *picture)[0] == 0
    assert path.read_bytes() == seen


def test_a_mesh_turns(run, sheet, labeled, tmp_path, limit):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    limit("frames of a turn", 3)
    turn, still = tmp_path / "turn.gif", tmp_path / "still.png"
    more = ["--labels", labeled[0], "--size", "64x48"]
    status, out, err = run("render", sheet, "-o", still, "-o", turn, *more)
    guess = "(up: y, guessed; change it with --up)"
    assert (status, out, err) == (0, f"wrote {still} {guess}\nwrote {turn} {guess}\n", "")
    assert size_of(turn) == ((64, 48), 3)
    assert size_of(still) == ((64, 48), 1)


@pytest.mark.parametrize(("arguments", "message"), [
    ([], "Missing option '-o'"),
    (["-o", "picture.jpg"], "got 'picture.jpg'"),
    (["-o", "p.png", "--azimuth", "nan"], "'nan' is not a finite number"),
    (["-o", "p.png", "--elevation", "-inf"], "-inf is not in the range"),
    (["-o", "p.png", "--elevation", 91], "91.0 is not in the range -90<=x<=90"),
    (["-o", "p.png", "--size", "big"], "'big' is not a size such as 1200x900"),
    (["-o", "p.png", "--size", "9000x10"], "must be at most 8192, got 9000"),
    (["-o", "p.png", "--view", "above"], "'above' is not one of 'front'"),
    (["-o", "p.png", "--color-by", "area"],
     "error: --color-by area needs labels, and {sheet} has none: give LABELS (see"),
    (["-o", "p.png", "--numbers"],
     "error: --numbers needs labels, and {sheet} has none: give LABELS (see"),
    (["-o", "p.png", "--color-by", "curvature"], "needs labels"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_a_wrong_command_line(run, sheet, tmp_path, arguments, message):
    arguments = [tmp_path / a if str(a).endswith("png") else a for a in arguments]
    status, _, err = run("render", sheet, *arguments)
    assert status == 2
    assert message.format(sheet=sheet) in err


def test_values_that_do_not_fit_name_their_file(run, sheet, labeled, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    values, path = tmp_path / "values.npy", tmp_path / "picture.png"
    np.save(values, np.arange(3))
    more = ["--labels", labeled[0], "--color-by", values]
    status, _, err = run("render", sheet, "-o", path, *more)
    assert status == 1
    assert (
        "values.npy: color_by must have one value per cell, (1152,), or one value per region, (4,),"
        " or one value per vertex, (625,); got shape (3,)" in err
    )
    assert not path.exists()


@pytest.fixture
def drawn(monkeypatch):
    """Record the arguments of each picture instead of drawing it."""
    calls = []

    def plot(cells, labels, **given):
        calls.append((cells, labels, given))
        return Plot([], "y")

    monkeypatch.setattr("superfacets.plot", plot)
    return calls


def test_points_are_colored_by_a_property_and_seen_from_a_viewpoint(run, tmp_path, drawn):
    path = tmp_path / "cloud.csv"
    rows = np.column_stack(
        [np.random.default_rng(0).random((9, 3)), np.arange(9) % 3, np.arange(9)]
    )
    np.savetxt(path, rows, delimiter=",", header="x,y,z,label,intensity", comments="")
    picture = ["render", path, "-o", tmp_path / "a.png", "--viewpoint", "1,2,3"]
    assert run(*picture, "--color-by", "intensity")[0] == 0
    assert run(*picture, "--color-by", "normal_z")[0] == 0
    (cells, labels, given), (_, _, other) = drawn
    assert cells.viewpoints.tolist() == [1, 2, 3]
    assert labels.tolist() == [0, 1, 2] * 3
    assert (given["color_by"].tolist(), given["scale_title"]) == ([*range(9)], "intensity")
    assert (other["color_by"], other["scale_title"]) == ("normal_z", None)


def test_surfaces_seen_from_behind_are_hidden_on_request(run, sheet, tmp_path, drawn):
    cloud, to = tmp_path / "cloud.xyz", ("-o", tmp_path / "a.png")
    np.savetxt(cloud, np.random.default_rng(0).random((9, 3)))
    for arguments in ((sheet,), (sheet, "--see-inside")):
        assert run("render", *arguments, *to)[0] == 0
    assert run("render", cloud, "--see-inside", "--viewpoint", "1,2,3", *to)[0] == 0
    assert [given["see_inside"] for _, _, given in drawn] == [False, True, True]
    status, _, err = run("render", cloud, "--see-inside", *to)
    assert status == 2
    assert "error: --see-inside needs normals, and " in err
    assert "cloud.xyz has none: give --viewpoint (see" in err
    assert len(drawn) == 3


def test_own_colors_are_drawn_without_labels_and_on_request(run, tmp_path, drawn):
    mesh, labels = shapes.strip(2), [0, 1]
    rgb = {name: np.array([0, 255, 0, 255], np.uint8) for name in ("red", "green", "blue")}
    rgb["red"][:] = 255
    colored, plain = tmp_path / "colored.ply", tmp_path / "plain.ply"
    write_mesh(colored, mesh, attributes=MeshAttributes(vertex=rgb))
    write_mesh(plain, mesh)
    write_labels(tmp_path / "l.npy", labels)
    expected = [[255, 85, 85], [255, 170, 170]]
    chosen = ("-o", tmp_path / "a.png", "--labels", tmp_path / "l.npy")
    by_color = ("-o", tmp_path / "a.png", "--color-by", "color")  # then no regions are expected
    assert run("render", colored, *by_color)[::2] == (0, "")
    for args in ((colored, "-o", tmp_path / "a.png"), (colored, *chosen, "--color-by", "color")):
        assert run("render", *args)[0] == 0
        assert (drawn[-1][2]["colors"].tolist(), drawn[-1][2]["color_by"]) == (expected, None)
    for args in ((colored, *chosen), (plain, "-o", tmp_path / "a.png")):
        assert run("render", *args)[0] == 0
        assert drawn[-1][2]["colors"] is None
    status, _, err = run("render", plain, "-o", tmp_path / "a.png", "--color-by", "color")
    assert (status, "plain.ply has no colors of faces, vertices or points" in err) == (1, True)
    labeled = tmp_path / "labeled.ply"
    write_mesh(labeled, mesh, [0, 1])
    assert run("render", labeled, "-o", tmp_path / "a.png", "--color-by", "color")[0] == 0
    assert drawn[-1][2]["colors"].tolist() == face_colors(mesh, [0, 1]).tolist()


@pytest.mark.parametrize("ending", [".las", ".ply"])
def test_z_is_up_in_formats_of_surveys(run, tmp_path, drawn, ending):
    post = np.random.default_rng(0).random((500, 3)) * [1, 1, 9]
    write_mesh(tmp_path / f"post{ending}", PointCloud(post), np.zeros(500, int))
    _, out, _ = run("render", tmp_path / f"post{ending}", "-o", tmp_path / "a.png")
    assert drawn[0][2]["view"].up == ("z" if ending == ".las" else "auto")
    assert ("guessed" in out) == (ending == ".ply")


def test_z_is_up_in_surfaces_of_a_cortex(run, tmp_path, drawn):
    integers = np.array([3, 1], ">i4").tobytes() + np.eye(3, dtype=">f4").tobytes()
    surface = b"\xff\xff\xfecreated by\n\n" + integers + np.arange(3, dtype=">i4").tobytes()
    (tmp_path / "lh.white").write_bytes(surface)
    status, out, _ = run("render", tmp_path / "lh.white", "-o", tmp_path / "a.png")
    assert (status, drawn[0][2]["view"].up, "guessed" in out) == (0, "z", False)
