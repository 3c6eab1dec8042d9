"""The command `render`."""

import numpy as np
import pytest
import shapes
from command_line import can_render

from superfacets import write_mesh


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


def test_rendering_wants_a_png(run, sheet, tmp_path):
    status, _, err = run("render", sheet, "-o", tmp_path / "picture.jpg")
    assert status == 2
    assert "picture.jpg: pictures are written as .png" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--azimuth", "nan"], "'nan' is not a finite number"),
        (["--elevation", "-inf"], "'-inf' is not a finite number"),
        (["--elevation", 91], "91.0 is not in the range -90<=x<=90"),
    ],
)
def test_angles_are_finite(run, sheet, tmp_path, arguments, message):
    status, _, err = run("render", sheet, "-o", tmp_path / "picture.png", *arguments)
    assert status == 2
    assert message in err


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
    assert run("render", sheet, "-o", plain) == (
        0,
        f"wrote {plain}\n",
        f"superfacets: note: {sheet} holds no labels: the picture is plain; --labels names a file"
        " of them\n",
    )
    assert run("render", tmp_path / "l.ply", "-o", labeled)[::2] == (0, "")
    assert run("render", sheet, "--labels", tmp_path / "l.npy", "-o", given)[0] == 0
    assert labeled.read_bytes() == given.read_bytes() != plain.read_bytes()
    turned = tmp_path / "turned.png"
    view = ["--up", "z", "--azimuth", "-40", "--elevation", "50"]
    assert run("render", tmp_path / "l.ply", "-o", turned, *view)[0] == 0
    assert turned.read_bytes() != labeled.read_bytes()
