"""The command `lift`."""

import json

import numpy as np
import pytest
import shapes
from command_line import files_in
from looking import camera_at, masks_of

import superfacets as sf
from superfacets_scans import regroup_segments
from superfacets_studio.labels.imports import read_import

Image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write a cube whose sides are regions, masks of its halves, and cameras."""
    monkeypatch.chdir(tmp_path)
    mesh = shapes.cube()
    sides = np.arange(mesh.n_faces) // 2
    sf.write_mesh("cube.ply", mesh, sides)
    middle = mesh.vertices.mean(axis=0)
    cameras = []
    for i, angle in enumerate(np.linspace(0, 2 * np.pi, 8, endpoint=False)):
        place = middle + [3 * np.cos(angle), 3 * np.sin(angle), 2 * (-1) ** i]
        cameras.append(camera_at(place, middle, name=f"{i}.jpg"))
    frames = [
        {
            "file_path": camera.name,
            "transform_matrix": (camera.pose @ np.diag([1, -1, -1, 1])).tolist(),
        }
        for camera in cameras
    ]
    document = {"w": 64, "h": 48, "fl_x": 50, "frames": frames}
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    (tmp_path / "poses").mkdir()
    (tmp_path / "masks").mkdir()
    for camera, mask in zip(cameras, masks_of(mesh, sides // 3, cameras), strict=True):
        name = camera.name[0]
        np.savetxt(f"poses/{name}.txt", camera.pose)
        Image.fromarray(mask.astype(np.uint8)).save(f"masks/{name}.png")
    (tmp_path / "intrinsics.txt").write_text("50 50 32 24")
    return tmp_path


LIFT = ("lift", "cube.ply", "cube.ply", "masks", "transforms.json")


def test_regions_are_labeled_by_masks(run, folder):
    status, out, err = run(*LIFT)
    assert status == 0
    assert err.startswith("superfacets: note: in .ply, new values replace face properties label")
    assert out == (
        "wrote cube.superfacets.ply\n"
        "cube.ply: 8 images: 100.0% of the area is visible; 2 labels: 100.0% of the area is"
        " labeled; mean score 1.00\n"
    )
    assert sf.read_labels("cube.superfacets.ply").tolist() == [0] * 6 + [1] * 6
    outputs = ("-o", "a.npy", "-o", "a.aggregation.json", "--consistent-ids", "-q")
    assert run(*LIFT, *outputs) == (0, "", "")
    assert sf.read_labels("a.npy").tolist() == [1] * 6 + [2] * 6
    groups = json.loads((folder / "a.aggregation.json").read_text())["segGroups"]
    assert [(group["segments"], group["label"]) for group in groups] == [([1], "1"), ([2], "2")]


def test_poses_of_their_own_and_facts_as_json(run, folder):
    status, out, _ = run(
        *LIFT[:-1], "poses", "--intrinsics", "intrinsics.txt", "--json", "-o", "a.aggregation.json"
    )
    assert status == 0
    assert json.loads(out) == {
        "file": "cube.ply", "n_images": 8, "n_labels": 2, "mean_score": 1.0, "seen_area": 1.0,
        "labeled_area": 1.0, "outputs": ["a.aggregation.json"],
    }  # fmt: skip
    groups = json.loads((folder / "a.aggregation.json").read_text())["segGroups"]
    assert [(group["label"], group["score"]) for group in groups] == [("object", 1.0)] * 2
    status, _, err = run(*LIFT[:-1], "poses")
    assert (status, err.count("\n")) == (2, 1)
    assert "intrinsics and size must be given for a folder of poses" in err


@pytest.mark.parametrize(
    ("option", "names", "objects"),
    [((), ["object"], [1, 2]), (("--consistent-ids",), ["1", "2"], [1])],
)
def test_the_studio_imports_objects(run, folder, option, names, objects):
    files = ("a.npy", "a.aggregation.json")
    assert run(*LIFT, "-o", files[0], "-o", files[1], *option)[0] == 0
    content = {name: (folder / name).read_bytes() for name in files}
    found = read_import(content, sf.read_mesh("cube.ply"), ())
    assert found.cells.tolist() == list(range(12))
    assert np.unique(found.objects).tolist() == objects
    assert [entry["name"] for entry in found.class_list] == names


@pytest.fixture
def segments(folder):
    """Segments of the vertices of the cube, with gaps in their ids, as a file."""
    sf.write_mesh("fine.ply", sf.subdivide(shapes.cube(), max_edge=0.2).mesh)
    mesh = sf.read_mesh("fine.ply")
    heights = np.digitize(mesh.vertices[:, 2], [0.3, 0.7])
    ids = 5 * (heights + 3 * (mesh.vertices[:, 0] > 0.5)) + 2
    ids[:40] = np.where(mesh.vertices[:40, 2] > 0.5, 90, ids[:40])
    sf.write_labels("fine.0.010000.segs.json", ids)
    return ids


def test_objects_of_segments_are_groups_of_these_segments(run, folder, segments):
    lift = ("lift", "fine.ply", "fine.0.010000.segs.json", *LIFT[3:], "--consistent-ids")
    assert run(*lift, "-o", "a.aggregation.json", "-o", "a.ply")[0] == 0
    document = json.loads((folder / "a.aggregation.json").read_text())
    assert document["segmentsFile"] == "scannet.fine.0.010000.segs.json"
    groups = {group["label"]: group["segments"] for group in document["segGroups"]}
    mesh = sf.read_mesh("fine.ply")
    of_faces = sf.face_labels(mesh, segments)
    lifted = sf.read_labels("a.ply")
    for label, own in groups.items():
        assert np.array_equal(np.isin(of_faces, own), lifted == int(label))
    assert sum(map(len, groups.values())) == len(np.unique(of_faces[lifted >= 0]))
    moved = regroup_segments("b.aggregation.json", "a.aggregation.json", "fine.0.010000.segs.json")
    assert {(found.n_lost, found.n_gained) for found in moved} == {(0, 0)}

    files = ("fine.0.010000.segs.json", "a.aggregation.json")
    content = {name: (folder / name).read_bytes() for name in files}
    assert np.array_equal(read_import(content, mesh, ()).cells, np.flatnonzero(lifted >= 0))


def test_segments_are_written_again_with_their_groups(run, folder, segments):
    for path in (folder / "masks").glob("*.png"):  # leaves segments without a label
        mask = np.asarray(Image.open(path)).copy()
        Image.fromarray(np.where(mask == 1, mask, 0).astype(np.uint8)).save(path)
    lift = ("lift", "fine.ply", "fine.0.010000.segs.json", *LIFT[3:], "--consistent-ids")
    outputs = ("b.segs.json", "b.aggregation.json", "b.npz", "b.annot", "b_sp_label.npy")
    assert run(*lift, *(text for name in outputs for text in ("-o", name)))[0] == 0
    assert sf.read_labels("b.segs.json").tolist() == segments.tolist()
    ranks = np.unique(segments, return_inverse=True)[1]
    assert np.load("b_sp_label.npy").tolist() == ranks.tolist()
    document = json.loads((folder / "b.aggregation.json").read_text())
    assert document["segmentsFile"] == "scannet.b.segs.json"
    (group,) = document["segGroups"]
    is_in = np.isin(segments, group["segments"])
    assert 0 < is_in.sum() < len(segments)
    with np.load("b.npz") as file:  # the nodes are objects
        assert file["region"].tolist() == [1]
        assert file["vertex_super_index"].tolist() == (is_in - 1).tolist()


def test_masks_that_show_no_region_much_give_no_labels(run, folder):
    for path in (folder / "masks").iterdir():
        mask = np.zeros((48, 64), np.uint8)
        mask[24, 32] = 1
        Image.fromarray(mask).save(path)
    status, out, _ = run(*LIFT, "-o", "a.npy", "-o", "a.aggregation.json", "-o", "a.ply")
    assert status == 0
    assert "0 labels: 0.0% of the area is labeled; mean score 0.00" in out
    assert json.loads((folder / "a.aggregation.json").read_text())["segGroups"] == []
    assert sf.read_labels("a.ply").max() == -1


def test_images_that_do_not_vote_are_noted(run, folder):
    Image.fromarray(np.zeros((48, 64), np.uint8)).save("masks/3.png")
    (folder / "masks" / "7.png").rename(folder / "masks" / "other.png")
    status, out, err = run(*LIFT, "-o", "a.npy")
    assert status == 0
    assert out.startswith("wrote a.npy (a label per face)\ncube.ply: 7 images: 100.0%")
    assert err == (
        "superfacets: note: masks without a camera are left out: other\n"
        "superfacets: note: there is no mask in image 3 (3.jpg)\n"
    )


def test_what_is_wrong_is_one_line_and_nothing_is_written(run, folder):
    before = files_in(folder)
    np.save("masks/2.npy", np.ones((48, 64), int))
    (folder / "masks" / "2.png").rename(folder / "2.png")
    np.save("masks/2.npy", np.ones((48, 60), int))
    for change, words in (
        (
            (),
            "image 2 (2.jpg): masks must have the size of the camera, 64 x 48 pixels, got 60 x 48",
        ),
        (("--agreement", "0"), "0.0 is not in the range 0<x<=1"),
        (("-o", "transforms.json"), "expected the ending"),
    ):
        status, out, err = run(*LIFT, *change)
        assert status in (1, 2)
        assert (out, err.count("\n")) == ("", 1)
        assert words in err
    (folder / "masks" / "2.npy").unlink()
    (folder / "2.png").rename(folder / "masks" / "2.png")
    document = json.loads((folder / "transforms.json").read_text())
    for frame in document["frames"]:
        frame["transform_matrix"] = np.diag(
            [1, -1, -1, 1]
        ).tolist()  # all at one corner of the cube
        frame["transform_matrix"][0][3] = 90
    (folder / "turned.json").write_text(json.dumps(document))
    status, _, err = run(*LIFT[:-1], "turned.json")
    assert (status, err.count("\n")) == (1, 1)
    assert "no camera sees the mesh: check that poses are camera-to-world" in err
    (folder / "turned.json").unlink()
    assert files_in(folder) == before
