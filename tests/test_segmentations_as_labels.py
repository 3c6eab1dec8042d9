"""Every public function that takes labels takes a `Segmentation`, with the same result."""

import inspect

import numpy as np
import pytest
import shapes
from looking import camera_at

import superfacets as sf
from superfacets import metrics

MESH = shapes.bumpy_sheet(8)
GRAPH = sf.build_face_graph(MESH)
CELLS = sf.CellGraph(GRAPH.positions, GRAPH.measures, *GRAPH.arcs, np.ones(GRAPH.n_arcs))
CAMERAS = [camera_at([0.5, -1.0, 3.0], [0.5, 0.5, 0.0])]
VALUES = np.arange(10.0)

CALLS = {
    "achievable_accuracy": lambda labels: metrics.achievable_accuracy(MESH, labels, labels),
    "achievable_iou": lambda labels: metrics.achievable_iou(MESH, labels, labels),
    "area_overlap": lambda labels: metrics.area_overlap(labels, labels, GRAPH.measures).areas,
    "attach_labels": lambda labels: sf.attach_labels(_other_mesh(), labels),
    "border_lines": lambda labels: sf.border_lines(MESH, labels).vertices,
    "compactness": lambda labels: metrics.compactness(MESH, labels),
    "cut_borders": lambda labels: sf.cut_borders(MESH, labels).labels,
    "enforce_connectivity": lambda labels: sf.enforce_connectivity(MESH, labels).labels,
    "evaluate": lambda labels: metrics.evaluate(MESH, labels, [labels]),
    "face_colors": lambda labels: sf.face_colors(MESH, labels),
    "find_boundaries": lambda labels: sf.find_boundaries(MESH, labels),
    "hierarchy": lambda labels: [
        *sf.hierarchy(MESH, [4], labels=labels).levels,
        *sf.hierarchy(MESH, [12], barriers=labels).levels,
    ],
    "lift": lambda labels: sf.lift(MESH, labels, [np.ones((48, 64), int)], CAMERAS).labels,
    "merge_small_regions": lambda labels: sf.merge_small_regions(MESH, labels, 0.9).labels,
    "plot": lambda labels: np.asarray(sf.plot(MESH, labels, smooth_borders=False)),
    "pool": lambda labels: sf.pool(labels, GRAPH.measures),
    "region_graph": lambda labels: sf.region_graph(MESH, labels).areas,
    "segment": lambda labels: sf.segment(MESH, 12, barriers=labels).labels,
    "segment_graph": lambda labels: sf.segment_graph(CELLS, 12, barriers=labels).labels,
    "smooth_borders": lambda labels: sf.smooth_borders(MESH, labels),
    "split_regions": lambda labels: [part.cells for part in sf.split_regions(MESH, labels)],
    "submesh": lambda labels: sf.submesh(MESH, labels, 3).cells,
    "transfer": lambda labels: sf.transfer(MESH, labels, MESH),
    "undersegmentation_error": lambda labels: metrics.undersegmentation_error(MESH, labels, labels),
    "unpool": lambda labels: sf.unpool(labels, VALUES),
    "vertex_labels": lambda labels: sf.vertex_labels(MESH, labels),
    "view": lambda labels: sf.view(MESH, labels, smooth_borders=False).html,
    "write_labels": lambda labels: sf.write_labels("labels.npy", labels),
    "write_mesh": lambda labels: sf.write_mesh("mesh.ply", MESH, labels),
    "write_regions": lambda labels: sf.write_regions("regions", MESH, labels),
}

OTHERS = {
    "batch", "evaluate_vertices", "face_labels", "group_segments", "place_seeds",
    "regroup_segments",
}  # fmt: skip
"""Functions that take files, labels of vertices, or seeds instead."""


def _other_mesh():
    trimesh = pytest.importorskip("trimesh")
    return trimesh.Trimesh(MESH.vertices, MESH.faces, process=False)


def _public_functions():
    for home in (sf, metrics):
        for name in home.__all__:
            if inspect.isfunction(getattr(home, name)):
                yield name, getattr(home, name)


def test_all_functions_with_labels_are_called():
    words = ("labels", "regions", "truth", "barriers", "init", "segments")
    found = {
        name
        for name, function in _public_functions()
        if any(parameter.endswith(words) for parameter in inspect.signature(function).parameters)
    }
    assert found - OTHERS == CALLS.keys()


@pytest.mark.parametrize("name", CALLS)
def test_a_segmentation_is_as_good_as_its_labels(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    segmentation = sf.segment(MESH, 10)
    expected = CALLS[name](segmentation.labels)
    for path in tmp_path.iterdir():
        path.rename(path.with_name("before"))
    assert _same(CALLS[name](segmentation), expected)
    if (tmp_path / "before").is_file():
        paths = [path for path in tmp_path.iterdir() if path.name != "before"]
        assert [path.read_bytes() for path in paths] == [(tmp_path / "before").read_bytes()]


def _same(one, other):
    if isinstance(one, list):
        return all(map(np.array_equal, one, other))
    return one is None or np.array_equal(one, other) or one == other


def test_the_replacement_for_segmentator_is_a_module():
    from superfacets import segmentator

    assert {*segmentator.__all__} == {"compute_vn", "segment_mesh", "segment_point"}
