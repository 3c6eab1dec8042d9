"""Clouds with all that their formats can hold: in and out, field by field; and damaged files."""

import os
import random
import subprocess
import sys
import warnings
from pathlib import Path

import damage
import numpy as np
import pytest

from superfacets import MeshAttributes, PointCloud, read_labels, write_mesh
from superfacets.tools.cell_file import CellFile

N = 300
RNG = np.random.default_rng(4)
LABELS = np.arange(N) // 100 - 1


def cloud_and_columns():
    """Return a cloud, and columns of all types that attributes have."""
    turns = RNG.normal(size=(N, 3))
    normals = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    colors = RNG.integers(0, 256, (N, 3)).astype(np.uint8)
    columns = {
        **dict(zip(("red", "green", "blue"), colors.T, strict=True)),
        "intensity": RNG.integers(0, 60_000, N).astype(np.uint16), "scalar": RNG.random(N),
        "single": np.where(np.arange(N) % 7, RNG.random(N), np.nan).astype(np.float32),
        "count": RNG.integers(-(2**31), 2**31, N).astype(np.int32),
        "wide": RNG.integers(0, 9, (N, 3)).astype(np.int16),
        "histogram": RNG.random((N, 5)).astype(np.float32),
    }  # fmt: skip
    points = np.round(RNG.random((N, 3)) * 100, 3) + [4e5, 5e6, 0]
    return PointCloud(points, normals, colors), columns


LOST = {
    ".ply": [], ".pcd": ["comments"], ".csv": ["comments"],
    ".las": ["vertex property histogram", "comments"],
    ".laz": ["vertex property histogram", "comments"],
}  # fmt: skip
"""What each format does not store of the attributes."""


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("ending", LOST)
def test_what_goes_into_a_cloud_file_comes_out(tmp_path, ending, ascii):
    pytest.importorskip("laspy" if ending in (".las", ".laz") else "pypcd4")
    if ascii and ending not in (".ply", ".pcd"):
        pytest.skip("has one form")
    cloud, columns = cloud_and_columns()
    attributes = MeshAttributes(vertex=columns, comments=["comment made by hand"])
    path = tmp_path / f"a{ending}"
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        write_mesh(path, cloud, LABELS, attributes=attributes, ascii=ascii)
    expected = [f"{ending} does not store: {'; '.join(LOST[ending])}"] * bool(LOST[ending])
    assert [str(each.message) for each in noted] == expected
    again, others = CellFile.read(path).cells_and_attributes()
    assert others.left_out == ()
    assert read_labels(path).tolist() == LABELS.tolist()
    assert np.abs(again.points - cloud.points).max() <= (1e-6 if ending[:3] == ".la" else 0)
    assert again.colors == pytest.approx(cloud.colors, abs=1e-7)
    if ending not in (".las", ".laz"):
        assert again.normals == pytest.approx(cloud.normals, abs=1e-7)
    for name, values in columns.items():
        if f"vertex property {name}" in LOST[ending]:
            continue
        if ending == ".csv" and values.ndim == 2:
            found = np.column_stack([others.vertex[f"{name}_{i}"] for i in range(values.shape[1])])
        else:
            found = others.vertex[name]
            assert found.dtype == values.dtype or ending == ".csv"
        found = found.astype(values.dtype)  # numbers of a text are doubles
        assert np.array_equal(found, values, equal_nan=values.dtype.kind == "f"), name


READ = """
import sys, time
from superfacets import MeshError
from superfacets.tools.cell_file import CellFile
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
except ImportError:  # Windows
    pass
n_other = 0
for path in sys.argv[2:]:
    began = time.monotonic()
    try:
        n_other += CellFile.read(path).cells().n_points != int(sys.argv[1])
    except MeshError as error:
        assert len(str(error)) < len(path) + 400 and "\\n" not in str(error), error
    assert time.monotonic() - began < 10, path
print(n_other)
"""
"""Reads files, and prints how many have another number of points than expected."""


def _whole(tmp_path, ending):
    cloud, columns = cloud_and_columns()
    path = tmp_path / f"whole{ending}"
    if ending == ".e57":
        pye57 = pytest.importorskip("pye57")
        with pye57.E57(str(path), mode="w") as file:
            names = ("cartesianX", "cartesianY", "cartesianZ")
            file.write_scan_raw(dict(zip(names, cloud.points.T.copy(), strict=True)))
    else:
        pytest.importorskip("laspy" if ending in (".las", ".laz") else "pypcd4")
        del columns["histogram"]
        write_mesh(path, cloud, LABELS, attributes=MeshAttributes(vertex=columns))
    return path.read_bytes()


@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer needs more")
@pytest.mark.parametrize("ending", [".las", ".laz", ".e57", ".pcd", ".csv", ".ply"])
def test_damaged_clouds_are_read_or_refused_in_little_memory(tmp_path, ending):
    whole, source = _whole(tmp_path, ending), random.Random(11)
    header = whole[:400]
    files = [damage.damaged(whole, source) for _ in range(4)]
    files += [whole[: source.randrange(len(whole))] for _ in range(4)]
    files += [damage.damaged(header, source) + whole[400:] for _ in range(4)]
    paths = [tmp_path / f"{place}{ending}" for place in range(len(files))]
    for path, content in zip(paths, files, strict=True):
        Path(path).write_bytes(content)
    command = [sys.executable, "-c", READ, str(N), *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) <= (4 if ending == ".csv" else 1)  # a text may be cut at any line
