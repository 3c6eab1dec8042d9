"""Strokes on point clouds paint the surface in front, not the points behind its gaps."""

import numpy as np
import pytest
from scipy import ndimage

from superfacets import PointCloud, write_mesh

N_WALL, N_CHAIR = 120_000, 5_000
BEHIND = 1.2  # distance of the chair from the wall


@pytest.fixture
def wall(serve, open_tab, tmp_path):
    """Return server and page of a closed wall with a chair behind it, seen from the front."""
    rng = np.random.default_rng(1)
    plane = rng.uniform((-2, 0, -1.5), (2, 0.004, 1.5), (N_WALL, 3))
    chair = rng.uniform((-0.4, 0, -0.5), (0.4, 0.3, 0.5), (N_CHAIR, 3)) + (0, BEHIND, 0)
    write_mesh(tmp_path / "room.ply", PointCloud(np.vstack([plane, chair])))
    server = serve(tmp_path / "room.ply", 60)
    tab = open_tab(server.address)
    tab.evaluate("""() => {
        const { session: { mesh }, drawing: { camera } } = studio.workbench;
        camera.fly(mesh.middleOf(0).map((value, k) => (k === 1 ? value : 0)), [0, -1, 0], 5);
    }""")
    tab.until("studio.workbench.drawing.isStale === false")
    return server, tab


def painted(server, tab):
    tab.settled()
    classes = server.classes()
    return np.count_nonzero(classes[:N_WALL]), np.count_nonzero(classes[N_WALL:])


def size_of(tab):
    box = tab.locator("#canvas").bounding_box()
    return box["width"], box["height"]


def test_strokes_and_lassos_over_a_closed_wall_paint_no_point_of_the_chair_behind_it(wall):
    server, tab = wall
    width, height = size_of(tab)
    drawn = tab.evaluate("[...new Set(studio.workbench.drawing.cellsSeen().cells)]")
    assert np.count_nonzero(np.asarray(drawn) >= N_WALL) > 200  # the chair is drawn in gaps
    lines = [[(60, y), (width - 60, y)] for y in np.linspace(60, height - 60, 12)]
    tab.drag(*[place for line in lines for place in line])
    on_wall, on_chair = painted(server, tab)
    assert on_chair == 0
    assert on_wall > N_WALL / 100

    tab.press("b", "2", *"++++")
    tab.drag((60, height / 2), (width - 60, height / 2))
    loop = [(60, 60), (width - 60, 60), (width - 60, height - 60), (60, height - 60), (60, 60)]
    for key in "lL":
        tab.press(key.lower())
        tab.drag(*loop)
    assert painted(server, tab)[1] == 0


def test_points_seen_through_gaps_of_a_wall_have_no_borders(wall):
    _, tab = wall
    pictures = """n => [true, false].map((on) => {
        const { drawing } = studio.workbench;
        drawing.hasBorders = on;
        drawing.draw(1);
        const [colors, { cells }] = [drawing.pixels(), drawing.cellsSeen()];
        return [...colors].filter((_, i) => cells[i] >= n && cells[i] < 2 ** 32 - 1);
    })"""
    lined, plain = np.array(tab.evaluate(pictures, N_WALL))
    assert len(lined) > 200
    assert np.mean(lined != plain) < 0.05


def test_a_chair_in_front_of_a_wall_and_the_wall_beside_it_are_both_picked(wall):
    _, tab = wall
    tab.evaluate("""() => {
        const { camera } = studio.workbench.drawing;
        camera.fly([...camera.target], [0, 1, 0], 9);
    }""")
    drawn, picked = np.array(
        tab.evaluate("""() => {
            const { drawing, picker } = studio.workbench;
            const { clientWidth, clientHeight } = drawing.canvas;
            const found = [[], []];
            for (let y = 3; y < clientHeight; y += 6) {
                found.forEach((rows) => rows.push([]));
                for (let x = 3; x < clientWidth; x += 6) {
                    found[0].at(-1).push(drawing.cellsSeen(x, y, 1, 1).cells[0] | 0);
                    found[1].at(-1).push(picker.cellAt({ x, y }));
                }
            }
            return found;
        }""")
    )
    is_chair = drawn >= N_WALL
    assert (picked[~ndimage.binary_dilation(is_chair, np.ones((5, 5)))] < N_WALL).all()
    solid = ndimage.binary_closing(is_chair, np.ones((5, 5)))
    is_inside = ndimage.binary_erosion(solid, np.ones((9, 9)))
    assert np.mean(is_chair[is_inside]) < 0.95  # the wall is drawn in gaps of the chair
    assert (picked[is_inside] >= N_WALL).all()
