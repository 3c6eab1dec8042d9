"""Regions divided in two by strokes."""

import numpy as np
import pytest
import shapes

from superfacets import Mesh
from superfacets_studio.regions.segmenting import Segmenter
from superfacets_studio.regions.splitting import split_cells


def sheet(height, n=20):
    """Return a square of side 1 with 2 n^2 triangles, whose height depends on x."""
    flat = shapes.flat(n)
    places = flat.vertices / n
    return Mesh(places + height(places[:, :1]) * [0, 0, 1], flat.faces)


def split(mesh, cells=None, red=None, blue=None):
    surface = Segmenter(mesh).surface
    x, y, _ = surface.positions.T
    cells = np.arange(surface.n_cells, dtype=np.uint32) if cells is None else cells
    near = np.abs(y - 0.5) < 0.1
    red = np.flatnonzero((x < 0.1) & near) if red is None else red
    blue = np.flatnonzero((x > 0.9) & near) if blue is None else blue
    found = split_cells(surface, cells, *(np.asarray(stroke, np.uint32) for stroke in (red, blue)))
    return found, surface.positions


def test_on_a_flat_square_the_border_is_in_the_middle():
    blue, positions = split(sheet(np.zeros_like))
    assert positions[blue, 0].min() > 0.45
    assert len(blue) == pytest.approx(400, rel=0.1)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("place", [0.25, 0.5, 0.75])
def test_grooves_and_ridges_are_the_border(sign, place):
    blue, positions = split(sheet(lambda x: sign * np.abs(x - place)))
    assert set(blue.tolist()) == set(np.flatnonzero(positions[:, 0] > place).tolist())


def test_both_sides_hold_their_strokes_and_hold_together():
    mesh = shapes.bumpy_sheet(16)
    surface = Segmenter(mesh).surface
    generator = np.random.default_rng(3)
    for _ in range(10):
        red, blue = generator.choice(mesh.n_faces, 2, replace=False)
        found, _ = split(mesh, red=[red], blue=[blue])
        sides = np.zeros(mesh.n_faces, bool)
        sides[found] = True
        assert sides[blue]
        assert not sides[red]
        for start in (red, blue):
            reached, front = {int(start)}, [int(start)]
            while front:
                cell = front.pop()
                around = surface.neighbors[surface.offsets[cell] : surface.offsets[cell + 1]]
                new = {int(c) for c in around if sides[c] == sides[start]} - reached
                reached |= new
                front += new
            assert len(reached) == np.count_nonzero(sides == sides[start])


def test_cells_outside_the_region_stay_out_of_it():
    mesh = sheet(np.zeros_like)
    cells = np.arange(200, 600, dtype=np.uint32)
    blue, _ = split(mesh, cells, red=[0, 200], blue=[599, 799])
    assert 0 < len(blue) < len(cells)
    assert np.isin(blue, cells).all()


def test_a_piece_that_nothing_leads_to_stays_red():
    one = sheet(np.zeros_like, 4)
    both = Mesh(
        np.concatenate([one.vertices, one.vertices + 9]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    blue, _ = split(both, red=[0], blue=[31])
    assert blue.max() < 32


def test_cells_without_area_are_split_too():
    mesh = Mesh([[x, 0, 0] for x in range(4)], [[0, 1, 2], [1, 2, 3]])
    assert split(mesh, red=[0], blue=[1])[0].tolist() == [1]


@pytest.mark.parametrize(("red", "blue", "message"), [
    ([], [1], "the red stroke is outside the region to split"),
    ([1], [399], "the blue stroke is outside the region to split"),
    ([1, 2], [2, 3], "the strokes cross"),
])  # fmt: skip
def test_wrong_strokes_are_refused(red, blue, message):
    with pytest.raises(ValueError, match=message):
        split(sheet(np.zeros_like), np.arange(300, dtype=np.uint32), red, blue)
