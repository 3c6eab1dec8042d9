"""A custom kind of cells, the pixels of an image, which one call registers for all stages."""

from dataclasses import dataclass

import numpy as np
import pytest

import superfacets
from superfacets import ArcMeasures, CellGraph, MeshError
from superfacets.graph import kinds
from superfacets.graph.kinds import Kind, register
from superfacets.mesh.base import Cells


@dataclass(frozen=True, eq=False)
class Image(Cells):
    """A gray image; its cells are the pixels, squares of side 1 in the plane z = 0."""

    values: np.ndarray  # (height, width)

    @property
    def n_cells(self):
        return self.values.size

    @property
    def bounds(self):
        height, width = self.values.shape
        return np.array([[0.0, 0, 0], [width, height, 0]])


class Pixels(Kind):
    """Pixels that share a side are neighbors; a step across an edge of the image costs more."""

    name, noun, plural = "pixels", "pixel", "pixels"

    def build_graph(self, cells, weld, n_threads):
        height, width = cells.values.shape
        number = np.arange(cells.n_cells).reshape(height, width)
        ends = [(number[:, :-1], number[:, 1:]), (number[:-1], number[1:])]
        pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
        arcs = np.concatenate([pairs, pairs[:, ::-1]])
        sources, targets = arcs[np.lexsort(arcs.T[::-1])].T
        values = cells.values.ravel()
        y, x = np.divmod(np.arange(cells.n_cells), width)
        graph = CellGraph(
            np.stack([x + 0.5, y + 0.5, np.zeros(cells.n_cells)], axis=1), np.ones(cells.n_cells),
            np.searchsorted(sources, np.arange(cells.n_cells + 1)), targets,
            1.0 + 20.0 * np.abs(values[sources] - values[targets]), cells.bounds,
            arc_measures=ArcMeasures(np.ones(len(sources))),
        )  # fmt: skip
        return graph, None


@pytest.fixture
def image(monkeypatch):
    """Return a dark 24 x 24 image with a bright square of 8 x 8 pixels in the middle."""
    monkeypatch.setattr(kinds, "_KINDS", dict(kinds._KINDS))
    register(Image, Pixels())
    values = np.zeros((24, 24))
    values[8:16, 8:16] = 1.0
    return Image(values)


def test_pixels_are_segmented_along_the_edges_of_the_image(image):
    result = superfacets.segment(image, 9)
    inside = image.values.ravel() == 1
    assert result.n_segments == 9
    assert set(result.labels[inside]).isdisjoint(result.labels[~inside])
    assert result.cells is image


def test_regions_of_pixels_have_a_graph(image):
    graph = superfacets.segment(image, 9).regions
    assert graph.areas.sum() == 24 * 24
    halves = superfacets.region_graph(image, np.repeat([0, 1], 288))
    assert (halves.areas.tolist(), halves.border_lengths.tolist()) == ([288, 288], [24])


def test_pixels_have_levels(image):
    nested = superfacets.hierarchy(image, [9, 2])
    inside = image.values.ravel() == 1
    assert [len(np.unique(labels)) for labels in nested.levels] == [9, 2]
    assert len(np.unique(nested.levels[1][inside])) == 1


def test_values_of_pixels_are_pooled(image):
    labels = image.values.ravel().astype(int)
    assert superfacets.pool(labels, image.values.ravel(), mesh=image).tolist() == [0, 1]


def test_pixels_are_measured_colored_carried_and_drawn(image):
    labels = image.values.ravel().astype(int)
    assert superfacets.metrics.evaluate(image, labels, [labels])["undersegmentation_error"] == 0
    assert len(np.unique(superfacets.face_colors(image, labels), axis=0)) == 2
    carried = superfacets.transfer(image, labels, [[12.0, 12, 0], [1, 1, 0]])
    assert carried.tolist() == [1, 0]
    assert "576 pixels" in superfacets.view(image, labels).html


def test_labels_of_pixels_are_written_and_pixels_are_not(image, tmp_path):
    labels = image.values.ravel().astype(int)
    superfacets.write_labels(tmp_path / "pixels.npy", labels)
    assert np.array_equal(np.load(tmp_path / "pixels.npy"), labels)
    with pytest.raises(
        MeshError,
        match=r"pixels cannot be written as a mesh: write only their labels \(\.npy,"
        r" \.seg, \.txt\)",
    ):
        superfacets.write_mesh(tmp_path / "pixels.ply", image, labels)
    with pytest.raises(
        MeshError, match="labels of vertices need a mesh, got pixels without vertices"
    ):
        superfacets.vertex_labels(image, labels)
    with pytest.raises(MeshError, match="pixels cannot be split"):
        superfacets.submesh(image, labels, 1)
    with pytest.raises(MeshError, match="expected a surface mesh, got a Image, which has no faces"):
        superfacets.border_lines(image, labels)
    with pytest.raises(MeshError, match="counts and sizes are not available for pixels"):
        superfacets.mesh_info(image)


def test_weights_that_need_angles_are_refused_for_pixels(image):
    with pytest.raises(
        ValueError,
        match=r"the weights 'superfacets' need angles between faces: call superfacets\.segment"
        " without weights for pixels",
    ):
        superfacets.segment(image, 9, weights="superfacets")


def test_a_class_that_is_not_registered_is_named():
    with pytest.raises(TypeError, match="Image is not a registered class of cells"):
        superfacets.segment(Image(np.zeros((2, 2))), 1)
