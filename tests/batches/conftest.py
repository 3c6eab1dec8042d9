"""Files for the tests of batches."""

import shutil

import pytest

from superfacets import sample_mesh, write_mesh


@pytest.fixture(scope="session")
def made_scans(tmp_path_factory):
    """Return a folder with meshes in subfolders, and a file that is not a mesh."""
    folder = tmp_path_factory.mktemp("made")
    for place, name in enumerate(["a/one.ply", "a/two.ply", "b/one.ply", "b/c/three.ply"]):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_mesh(path, sample_mesh(3_000 * (1 + place)))
    (folder / "bad.ply").write_text("not a mesh")
    return folder


@pytest.fixture
def scans(made_scans, tmp_path):
    return shutil.copytree(made_scans, tmp_path / "scans")


@pytest.fixture
def scan(scans):
    return scans / "a" / "one.ply"


@pytest.fixture
def many(scans):
    """Return the folder with more files, so that a batch takes a while."""
    source = (scans / "b" / "c" / "three.ply").read_bytes()
    for place in range(20):
        (scans / f"more{place}.ply").write_bytes(source)
    return scans
