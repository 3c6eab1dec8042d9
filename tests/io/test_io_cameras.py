"""Cameras of COLMAP models, transforms.json and folders of poses."""

import json
import struct

import numpy as np
import pytest
from looking import camera_at
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import superfacets as sf

CAMERAS = [
    camera_at([1, 2, 3], [0, 0, 0], name="a 1.png"),
    camera_at([-4, 2, 0.5], [0, 1, 0], name="b.jpg"),
]


def to_camera(camera):
    """Return quaternion (w first) and translation from world to camera."""
    matrix = np.linalg.inv(camera.pose)
    return [*np.roll(Rotation.from_matrix(matrix[:3, :3]).as_quat(), 1), *matrix[:3, 3]]


def write_text(folder, cameras, model="PINHOLE 64 48 50 50 32 24"):
    folder.mkdir(exist_ok=True)
    (folder / "cameras.txt").write_text(f"# comment\n\n7 {model}\n")
    lines = ["# comment"]
    for place, camera in enumerate(cameras):
        numbers = " ".join(map(repr, map(float, to_camera(camera))))
        points = "1.5 2.5 -1 3 4 7" if place else ""  # an empty line if there are none
        lines += [f"{place + 1} {numbers} 7 sub/{camera.name}", points]
    (folder / "images.txt").write_text("\n".join(lines))


def write_binary(folder, cameras, model=1, params=(50, 50, 32, 24)):
    folder.mkdir(exist_ok=True)
    content = struct.pack(f"<QIiQQ{len(params)}d", 1, 7, model, 64, 48, *params)
    (folder / "cameras.bin").write_bytes(content)
    content = struct.pack("<Q", len(cameras))
    for place, camera in enumerate(cameras):
        content += struct.pack("<I7dI", place + 1, *to_camera(camera), 7)
        content += f"sub/{camera.name}".encode() + b"\0"
        content += struct.pack("<Q", place) + bytes(24 * place)
    (folder / "images.bin").write_bytes(content)


def write_json(path, cameras, **values):
    frames = [
        {"file_path": f"images/{camera.name}", "transform_matrix": opengl(camera.pose).tolist()}
        for camera in cameras
    ]
    intrinsics = {"fl_x": 50, "fl_y": 50, "cx": 32, "cy": 24, "w": 64.0, "h": 48, "k1": 0}
    document = {**intrinsics, **values, "frames": frames}
    path.write_text(json.dumps({k: v for k, v in document.items() if v is not None}))


def opengl(pose):
    return pose @ np.diag([1, -1, -1, 1])


def check(found, expected=CAMERAS):
    assert [camera.name for camera in found] == [camera.name for camera in expected]
    for camera, right in zip(found, expected, strict=True):
        assert_allclose(camera.pose, right.pose, atol=1e-12)
        assert_allclose(camera.intrinsics, right.intrinsics, atol=1e-9)
        assert camera.size == right.size


def test_models_of_colmap_are_read_as_text_and_binary(tmp_path):
    write_text(tmp_path / "text", CAMERAS)
    write_binary(tmp_path / "binary", CAMERAS)
    check(sf.read_cameras(tmp_path / "text"))
    check(sf.read_cameras(tmp_path / "binary"))
    check(sf.read_cameras(tmp_path / "binary", names={"b"}), CAMERAS[1:])
    (tmp_path / "text" / "cameras.bin").write_bytes(b"")  # without images.bin, text files are read
    check(sf.read_cameras(tmp_path / "text"))


def test_models_with_distortion_that_is_zero_are_pinhole_cameras(tmp_path):
    write_text(tmp_path, CAMERAS, "OPENCV 64 48 50 50 32 24 0 0.0 0 0")
    check(sf.read_cameras(tmp_path))
    write_text(tmp_path, CAMERAS, "SIMPLE_RADIAL 64 48 50 32 24 0")
    check(sf.read_cameras(tmp_path))
    write_text(tmp_path, CAMERAS, "SIMPLE_PINHOLE 64 48 50 32 24")
    check(sf.read_cameras(tmp_path))


DISTORTED = [
    ("OPENCV 64 48 50 50 32 24 0.1 0 0 0", "camera 7, OPENCV, has distortion"),
    ("SIMPLE_RADIAL 64 48 50 32 24 0.01", "camera 7, SIMPLE_RADIAL, has distortion"),
    ("OPENCV_FISHEYE 64 48 50 50 32 24 0 0 0 0", "camera 7 has the model OPENCV_FISHEYE"),
    ("UNKNOWN 64 48 50", "camera 7 has the model UNKNOWN"),
]


@pytest.mark.parametrize(("model", "words"), DISTORTED)
def test_distortion_is_refused_in_one_line(model, words, tmp_path):
    write_text(tmp_path, CAMERAS, model)
    with pytest.raises(sf.MeshError, match=words) as caught:
        sf.read_cameras(tmp_path)
    assert "only pinhole cameras are supported (PINHOLE, SIMPLE_PINHOLE," in str(caught.value)
    assert "undistort images and masks first" in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'cameras.txt'}: ")


def test_distortion_in_binary_files_and_json_is_refused(tmp_path):
    for model, params in ((4, (50, 50, 32, 24, 0.1, 0, 0, 0)), (5, (50,) * 8), (99, ())):
        write_binary(tmp_path, CAMERAS, model, params)
        with pytest.raises(sf.MeshError, match="only pinhole cameras"):
            sf.read_cameras(tmp_path)
    path = tmp_path / "transforms.json"
    for values in ({"k1": 0.1}, {"is_fisheye": True}, {"camera_model": "OPENCV_FISHEYE"}):
        write_json(path, CAMERAS, **values)
        with pytest.raises(sf.MeshError, match=r"frames\[0\]: the camera .* only pinhole cameras"):
            sf.read_cameras(path)


def test_transforms_of_nerf_are_read(tmp_path):
    path = tmp_path / "transforms.json"
    write_json(path, CAMERAS)
    check(sf.read_cameras(path))
    angles = {"camera_angle_x": 2 * np.arctan(32 / 50), "camera_angle_y": 2 * np.arctan(24 / 50)}
    bare = dict.fromkeys(["fl_x", "fl_y", "cx", "cy"])
    write_json(path, CAMERAS, camera_model="OPENCV", **angles, **bare)
    check(sf.read_cameras(path))
    # As in NeRF's synthetic scenes: one angle, and the size is known only from the images.
    del angles["camera_angle_y"]
    write_json(path, CAMERAS, **angles, **bare, w=None, h=None)
    check(sf.read_cameras(path, size=(64, 48)))
    with pytest.raises(sf.MeshError, match=r"w or h is missing: pass size=\(width, height\)"):
        sf.read_cameras(path)


def test_poses_in_files_of_their_own_are_read(tmp_path):
    folder = tmp_path / "pose"
    folder.mkdir()
    for number, camera in zip((10, 9), CAMERAS, strict=True):
        np.savetxt(folder / f"{number}.txt", camera.pose)
    matrix = np.eye(4)
    matrix[:2, :3] = [[50, 0, 32], [0, 50, 24]]
    np.savetxt(tmp_path / "intrinsics.txt", matrix)
    for intrinsics in (tmp_path / "intrinsics.txt", matrix, (50, 50, 32, 24)):
        found = sf.read_cameras(folder, intrinsics=intrinsics, size=(64, 48))
        assert [camera.name for camera in found] == ["9", "10"]
        for camera, right in zip(found, CAMERAS[::-1], strict=True):
            assert_allclose(camera.pose, right.pose)
            assert camera.intrinsics.tolist() == [50, 50, 32, 24]
    with pytest.raises(ValueError, match="intrinsics and size must be given for a folder of poses"):
        sf.read_cameras(folder, size=(64, 48))
    (tmp_path / "intrinsics.txt").write_text("50 50 32 24\n")
    assert len(sf.read_cameras(folder, intrinsics=tmp_path / "intrinsics.txt", size=(64, 48))) == 2
    # Unknown poses, as in ScanNet.
    np.savetxt(folder / "11.txt", np.full((4, 4), -np.inf))
    with pytest.raises(
        sf.MeshError, match="image 11: pose must be finite: leave out images whose pose is unknown"
    ):
        sf.read_cameras(folder, intrinsics=matrix, size=(64, 48))
    found = sf.read_cameras(folder, intrinsics=matrix, size=(64, 48), names=["9", "10"])
    assert len(found) == 2


@pytest.mark.parametrize("name", ["cameras.bin", "images.bin", "images.txt", "cameras.txt"])
def test_cut_models_are_refused(name, tmp_path):
    write = write_text if name.endswith("txt") else write_binary
    write(tmp_path, CAMERAS)
    path = tmp_path / name
    content = path.read_bytes()
    for size in range(1, len(content), 7):
        path.write_bytes(content[:size])
        message = refusal(tmp_path)
        if message is None:  # a text file may be cut after a line or in a number
            assert name.endswith("txt")
        else:
            assert message.startswith(str(tmp_path))
            assert "\n" not in message


def refusal(path):
    """Return the message of the error that reading a file raises, or None."""
    try:
        sf.read_cameras(path)
    except sf.MeshError as error:
        return str(error)
    return None


def test_counts_that_lie_do_not_take_memory(tmp_path):
    write_binary(tmp_path, CAMERAS)
    for name in ("cameras.bin", "images.bin"):
        content = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(struct.pack("<Q", 2**60) + content[8:])
        with pytest.raises(sf.MeshError, match="it may be truncated"):
            sf.read_cameras(tmp_path)
        (tmp_path / name).write_bytes(content)


@pytest.mark.parametrize(("text", "words"), [
    ("{", "is not valid JSON: Expecting property name"),
    ("[]", "expected a JSON object with a list of frames"),
    ('{"frames": [1]}', "expected a JSON object with a list of frames"),
    ('{"frames": []}', "there is no image"),
    ('{"frames": [{}], "w": 4, "h": 4}',
     r"frames\[0\]: fl_x and camera_angle_x are missing: one of them is required"),
    ('{"frames": [{}], "w": 4, "h": 4, "fl_x": 4}', r"frames\[0\]: file_path is missing"),
    ('{"frames": [{}], "w": null, "h": 4}',
     r"frames\[0\]: sizes, focal lengths, centers and matrices must be numbers"),
    ('{"frames": [{}], "w": 4, "h": 4, "fl_x": "far"}',
     r"frames\[0\]: sizes, focal lengths, centers and matrices must be numbers"),
])  # fmt: skip
def test_damaged_json_is_refused(text, words, tmp_path):
    path = tmp_path / "transforms.json"
    path.write_text(text)
    with pytest.raises(sf.MeshError, match=words):
        sf.read_cameras(path)


def test_wrong_poses_and_names_are_refused(tmp_path):
    path = tmp_path / "transforms.json"
    write_json(path, [*CAMERAS, sf.PinholeCamera(np.eye(4), (50, 50, 32, 24), (64, 48), "c.png")])
    document = json.loads(path.read_text())
    document["frames"][2]["transform_matrix"][0][0] = 3
    path.write_text(json.dumps(document))
    with pytest.raises(sf.MeshError, match=r"image images/c.png: pose must be a rotation"):
        sf.read_cameras(path)
    write_json(path, [CAMERAS[0], CAMERAS[0]])
    with pytest.raises(
        sf.MeshError, match="without folder and ending must differ, but two images are named a 1"
    ):
        sf.read_cameras(path)
    with pytest.raises(sf.MeshError, match="there is no image with one of the given names"):
        sf.read_cameras(path, names=["z"])
    with pytest.raises(FileNotFoundError):
        sf.read_cameras(tmp_path / "none.json")
    (tmp_path / "empty").mkdir()
    with pytest.raises(
        sf.MeshError,
        match=r"expected a COLMAP model \(cameras and images, \.bin or \.txt\) or poses"
        r" \(one \.txt file of 4 x 4 numbers per image\)",
    ):
        sf.read_cameras(tmp_path / "empty")
    write_text(tmp_path / "model", CAMERAS)
    (tmp_path / "model" / "cameras.txt").write_text("1 PINHOLE 64 48 50 50 32 24\n")
    with pytest.raises(sf.MeshError, match="refers to camera 7, which does not exist"):
        sf.read_cameras(tmp_path / "model")
    (tmp_path / "model" / "cameras.txt").write_text("7 PINHOLE 64 48 50\n")
    with pytest.raises(sf.MeshError, match="camera 7, PINHOLE, must have 4 parameters, got 1"):
        sf.read_cameras(tmp_path / "model")
    (tmp_path / "poses").mkdir()
    (tmp_path / "poses" / "1.txt").write_text("1 2\n3")
    with pytest.raises(sf.MeshError, match="the rows of the matrix must have the same length"):
        sf.read_cameras(tmp_path / "poses", intrinsics=(5, 5, 2, 2), size=(4, 4))


@pytest.mark.parametrize("line", ["1 0 0 0 0 0 0 0 1 a.png", "1 inf 0 0 0 0 0 0 1 a.png"])
def test_a_colmap_pose_without_a_rotation_is_refused(tmp_path, line):
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 4 4 10 10 2 2\n")
    (tmp_path / "images.txt").write_text(f"{line}\n\n")
    with pytest.raises(sf.MeshError, match=r"images\.txt: a pose must be finite, with a "):
        sf.read_cameras(tmp_path)


@pytest.mark.parametrize("scale", [1e200, 1e-200])
def test_poses_with_a_huge_scale_are_refused(scale):
    pose = scale * np.array([[1, 1, 0, 0], [-1, 1, 0, 0], [0, 0, 1, 0]])
    with pytest.raises(ValueError, match="pose must be a rotation and a position"):
        sf.PinholeCamera(pose, (10, 10, 2, 2), (4, 4))
