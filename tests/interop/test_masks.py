"""Masks of images in files."""

import numpy as np
import pytest

import superfacets as sf

Image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")

IDS = np.array([[0, 1, 2], [300, 2, 0]])


def test_label_images_are_read(tmp_path):
    Image.fromarray(IDS.astype(np.uint16)).save(tmp_path / "deep.png")
    Image.fromarray((IDS % 256).astype(np.uint8)).save(tmp_path / "gray.PNG")
    with_palette = Image.fromarray((IDS % 256).astype(np.uint8)).convert("P")
    with_palette.putpalette([200 - i for i in range(200) for _ in range(3)])
    with_palette.save(tmp_path / "palette.png")
    Image.fromarray(IDS > 1).save(tmp_path / "two.png")  # one bit per pixel
    np.save(tmp_path / "ids.npy", IDS)
    (tmp_path / "metadata.csv").write_text("ignored")
    found = sf.read_masks(tmp_path)
    assert list(found) == ["deep", "gray", "ids", "palette", "two"]
    assert found["deep"].tolist() == found["ids"].tolist() == IDS.tolist()
    assert found["gray"].tolist() == found["palette"].tolist() == (IDS % 256).tolist()
    assert found["two"].tolist() == (IDS > 1).tolist()


def test_stacks_of_masks_are_read_and_the_smallest_counts(tmp_path):
    whole = np.ones((2, 3), bool)
    part = IDS == 2
    np.save(tmp_path / "stack.npy", np.stack([whole, part]))
    folder = tmp_path / "sam"  # as amg.py writes it
    folder.mkdir()
    for number, mask in ((0, part), (2, part), (10, whole)):
        Image.fromarray(np.uint8(255) * mask).save(folder / f"{number}.png")
    (folder / "metadata.csv").write_text("id,area")
    (tmp_path / "other").mkdir()
    found = sf.read_masks(tmp_path)
    assert list(found) == ["sam", "stack"]
    assert found["stack"].tolist() == np.where(part, 2, 1).tolist()
    assert found["sam"].tolist() == np.where(part, 1, 3).tolist()
    wholes = sf.read_masks(tmp_path, overlap="largest")
    assert np.unique(wholes["stack"]).tolist() == [1]
    assert np.unique(wholes["sam"]).tolist() == [3]


def test_what_is_wrong_with_masks_is_said_in_a_line(tmp_path):
    with pytest.raises(sf.MeshError, match="a folder per image, but has no masks"):
        sf.read_masks(tmp_path)
    with pytest.raises(FileNotFoundError):
        sf.read_masks(tmp_path / "none")
    path = tmp_path / "a.png"
    Image.fromarray(np.zeros((2, 3, 3), np.uint8)).save(path)
    with pytest.raises(sf.MeshError, match=r"a\.png: masks must be gray, .* got colors \(RGB\)"):
        sf.read_masks(tmp_path)
    Image.fromarray(np.zeros((90, 90), np.uint8)).save(path)
    for content in (path.read_bytes()[:60], b"not a picture", b""):
        path.write_bytes(content)
        with pytest.raises(sf.MeshError, match=r"a\.png: is not a complete PNG"):
            sf.read_masks(tmp_path)
    path.unlink()
    np.save(tmp_path / "a.npy", np.zeros((2, 3)))
    with pytest.raises(
        sf.MeshError, match=r"a\.npy: masks must be arrays of integers or bools, got float64"
    ):
        sf.read_masks(tmp_path)
    np.save(tmp_path / "a.npy", IDS)
    Image.fromarray(np.zeros((2, 3), np.uint8)).save(path)
    with pytest.raises(sf.MeshError, match="image a has two files of masks"):
        sf.read_masks(tmp_path)
    path.unlink()
    folder = tmp_path / "b"
    folder.mkdir()
    for size in (2, 3):
        Image.fromarray(np.zeros((size, 3), np.uint8)).save(folder / f"{size}.png")
    with pytest.raises(sf.MeshError, match="all masks of an image must have the same size"):
        sf.read_masks(tmp_path)
