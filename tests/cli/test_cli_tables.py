"""Tables and lines in files."""

import json

import numpy as np
import pytest

from superfacets import BorderLines, MeshError
from superfacets_cli.regions import write_tables
from superfacets_formats import write_vtk_xml
from superfacets_show import write_borders

COLUMNS = {"region": np.array([3, 7]), "area": np.array([0.1, np.nan])}


def test_numbers_keep_all_digits_and_what_is_nan_is_left_out(tmp_path):
    write_tables([(tmp_path / "table.CSV", COLUMNS), (tmp_path / "table.json", COLUMNS)])
    assert (tmp_path / "table.CSV").read_bytes() == b"region,area\n3,0.1\n7,\n"
    assert json.loads((tmp_path / "table.json").read_text()) == [
        {"region": 3, "area": 0.1}, {"region": 7, "area": None},
    ]  # fmt: skip


def test_all_tables_appear_or_none(tmp_path):
    with pytest.raises(MeshError, match=r"table\.xls: expected the ending \.csv"):
        write_tables([(tmp_path / "table.csv", COLUMNS), (tmp_path / "table.xls", COLUMNS)])
    with pytest.raises(OSError, match="none"):
        write_tables([(tmp_path / "table.csv", COLUMNS), (tmp_path / "none" / "t.csv", COLUMNS)])
    assert list(tmp_path.iterdir()) == []


def lines_of(vertices, offsets, regions, is_closed):
    arrays = map(np.array, (vertices, offsets, regions, is_closed))
    return BorderLines(*arrays, lengths=np.ones(len(is_closed)), junctions=np.array([]))


def test_lines_hold_the_vertices_that_they_use(tmp_path):
    vertices = np.arange(12.0).reshape(4, 3) / 10
    path, names = tmp_path / "lines.obj", np.array([3, 7])
    lines = lines_of([3, 1, 1, 0], [0, 2, 4], [[0, 1], [1, -1]], [False, True])
    none = lines_of([], [0], np.empty((0, 2), int), [])
    write_borders(path, write_vtk_xml, vertices, lines, names)
    assert path.read_text().splitlines() == [
        "v 0.0 0.1 0.2", "v 0.3 0.4 0.5", "v 0.9 1.0 1.1",
        "g border_3_7", "l 3 2", "g border_7_open", "l 2 1 2",
    ]  # fmt: skip
    write_borders(path, write_vtk_xml, vertices, none, names)
    assert path.read_text() == ""
    pyvista = pytest.importorskip("pyvista")
    write_borders(tmp_path / "lines.vtp", write_vtk_xml, vertices, lines, names)
    read = pyvista.read(tmp_path / "lines.vtp")
    assert read.points.tolist() == vertices[[0, 1, 3]].tolist()
    assert read.lines.tolist() == [2, 2, 1, 3, 1, 0, 1]
    assert read.cell_data["low"].tolist() == [3, 7]
    assert read.cell_data["high"].tolist() == [7, -1]
    write_borders(tmp_path / "none.vtp", write_vtk_xml, vertices, none, names)
    assert pyvista.read(tmp_path / "none.vtp").n_cells == 0
    with pytest.raises(MeshError, match=r"expected the ending \.obj, \.vtp"):
        write_borders(tmp_path / "lines.ply", write_vtk_xml, vertices, none, names)
