"""Regions for the positions of sliders."""

import threading

import numpy as np
import pytest
import shapes

import superfacets
from superfacets import Weights
from superfacets_studio.regions import segmenting


@pytest.fixture
def segmenter():
    opened = segmenting.Segmenter(shapes.bumpy_sheet(24))
    yield opened
    opened.close()


def test_regions_are_those_of_segment(segmenter):
    usual = segmenting.default_parameters(1152)
    for change in ({"n_segments": 30}, {"alpha": 2.0}, {"ridges": 0.5}, {"smooth": False}):
        parameters = {**usual, **change}
        base = segmenter.run(parameters)
        weights = Weights(alpha=parameters["alpha"], ridges=parameters["ridges"])
        given = {name: parameters[name] for name in ("n_segments", "smooth")}
        expected = superfacets.segment(segmenter.source, weights=weights, **given).labels
        assert np.array_equal(base.labels, expected)


def test_levels_are_those_of_the_hierarchy(segmenter):
    parameters = {**segmenting.default_parameters(1152), "n_segments": 40, "level": 9}
    labels = superfacets.segment(segmenter.source, 40).labels
    expected = superfacets.hierarchy(segmenter.source, [9], labels=labels).levels[0]
    assert np.array_equal(segmenter.run(parameters).labels, expected)


def test_regions_that_are_kept_take_no_time(segmenter):
    parameters = segmenting.default_parameters(1152)
    base = segmenter.run(parameters)
    stages = []
    assert segmenter.run(parameters, segmenting.SegmentationTask(stages.append)) is base
    assert stages == []


def test_a_turn_that_is_cancelled_ends(segmenter):
    turn = segmenting.SegmentationTask(lambda fact: turn.cancel())
    with pytest.raises(segmenting.Cancelled):
        segmenter.run(segmenting.default_parameters(1152), turn)
    assert segmenter.run(segmenting.default_parameters(1152)).n_regions == 150


def test_closing_ends_the_run():
    segmenter = segmenting.Segmenter(shapes.bumpy_sheet(24))
    begun, errors = threading.Event(), []

    def tell(_):
        begun.set()
        threading.Event().wait(0.05)

    def run():
        try:
            segmenter.run(segmenting.default_parameters(1152), segmenting.SegmentationTask(tell))
        except segmenting.Cancelled as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    begun.wait()
    segmenter.close()
    thread.join()
    assert len(errors) == 1


def test_a_level_below_the_number_of_components_is_refused():
    one = shapes.bumpy_sheet(4)
    apart = superfacets.Mesh(
        np.concatenate([one.vertices, one.vertices + 50]),
        np.concatenate([one.faces, one.faces + one.n_vertices]),
    )
    segmenter = segmenting.Segmenter(apart)
    with pytest.raises(
        ValueError,
        match=r"level must be at least 2 because merging stops if no regions are neighbors, got 1$",
    ):
        segmenter.run({**segmenting.default_parameters(64, 8), "level": 1})
    segmenter.close()


def test_notes_say_what_segment_warns_of():
    long = superfacets.Mesh(
        [[x, y, 0] for x in range(41) for y in (0, 0.001)],
        [[2 * i, 2 * i + 2, 2 * i + 1] for i in range(40)],
    )
    segmenter = segmenting.Segmenter(long)
    notes = segmenter.run(segmenting.default_parameters(40, 20)).notes
    assert any("Triangles are long and thin" in note for note in notes)
    assert "20 small disconnected pieces of the mesh became additional regions." in notes
    notes = segmenter.run(segmenting.default_parameters(40, 39)).notes
    assert "1 small disconnected piece of the mesh became an additional region." in notes
    segmenter.close()


def test_offered_levels_halve():
    assert segmenting.levels_of(150) == [150, 75, 37, 18, 9, 4]
    assert segmenting.levels_of(1) == [1]


def test_the_surface_of_prepared_cells_has_components_and_a_region_graph():
    mesh = shapes.bumpy_sheet(24)
    mesh = superfacets.Mesh(mesh.vertices, np.random.default_rng(0).permutation(mesh.faces))
    surface, labels = segmenting.Segmenter(mesh).surface, superfacets.segment(mesh, 9).labels
    graph = superfacets.RegionGraph.of_surface(surface, labels)
    assert np.array_equal(graph.edge_index, superfacets.region_graph(mesh, labels).edge_index)
    assert len(np.unique(surface.components(labels))) == 9
    with pytest.raises(ValueError, match="labels must have one value per cell"):
        surface.components([5])
    with pytest.raises(ValueError, match="offsets and neighbors must be the arcs of the cells in"):
        surface.part(labels[:1], *np.zeros((3, 1), np.int64))
