"""Indices that the core has checked are private to it: nobody can change them afterwards."""

import copy
import pickle
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import ArcMeasures, CellGraph, Mesh, MeshError
from superfacets.paper import superfacet_weights

OUT_OF_RANGE = 2_000_000_000


def copies_of(original):
    return copy.copy(original), copy.deepcopy(original), pickle.loads(pickle.dumps(original))


def arrays_of(graph):
    names = ("positions", "measures", "offsets", "neighbors", "weights", "bounds")
    return {name: np.array(getattr(graph, name)) for name in names}


@pytest.fixture
def graph():
    mesh = shapes.bumpy_sheet(8)
    faces = sf.build_face_graph(mesh)
    return faces.with_weights(superfacet_weights(mesh, faces))


def test_faces_changed_after_the_check_change_nothing():
    original = shapes.bumpy_sheet(8)
    faces = np.array(original.faces)
    mesh = Mesh(np.array(original.vertices), faces)
    faces[:] = OUT_OF_RANGE
    assert np.array_equal(sf.segment(mesh, 5).labels, sf.segment(original, 5).labels)


def test_arcs_and_weights_changed_after_the_check_change_nothing(graph):
    arrays = arrays_of(graph)
    own = CellGraph(**arrays)
    for name in ("offsets", "neighbors"):
        arrays[name][:] = OUT_OF_RANGE
    arrays["weights"][:] = np.nan
    assert np.array_equal(sf.segment_graph(own, 5).labels, sf.segment_graph(graph, 5).labels)
    assert np.array_equal(own.weights, graph.weights)


def test_sides_of_arcs_changed_after_the_check_change_nothing(graph):
    sides = np.zeros(graph.n_arcs, np.int32)
    measures = ArcMeasures(np.ones(graph.n_arcs), sides=sides)
    own = CellGraph(**arrays_of(graph), arc_measures=measures)
    sides[:] = OUT_OF_RANGE
    for twin in (own, *copies_of(own)):
        assert not twin.arc_measures.sides.any()


def test_labels_seeds_and_centers_are_copies():
    mesh = shapes.bumpy_sheet(8)
    graph = sf.build_face_graph(mesh).with_weights(np.ones(sf.build_face_graph(mesh).n_arcs))
    from superfacets.base.checks import (
        checked_partial_labels,
        checked_seeds,
        compact_partial_labels,
    )

    for dtype in (np.int32, np.int64):
        labels = np.arange(mesh.n_faces, dtype=dtype)
        for check in (checked_partial_labels, compact_partial_labels):
            assert not np.shares_memory(check(labels, mesh.n_faces)[0], labels)
        assert not np.shares_memory(checked_seeds(labels, mesh.n_faces), labels)
    assert sf.classify(graph, np.array([0, 5], np.int32)).centers.tolist() == [0, 5]


def test_copies_and_pickles_are_read_only_and_equal(graph):
    mesh = shapes.bumpy_sheet(8)
    faces = sf.build_face_graph(mesh)
    for original in (mesh, faces, graph):
        for twin in copies_of(original):
            assert type(twin) is type(original)
            for name in type(original).__dataclass_fields__:
                value = getattr(twin, name)
                if isinstance(value, np.ndarray):
                    assert np.array_equal(value, getattr(original, name))
                    assert not value.flags.writeable
    for twin in copies_of(mesh):
        assert np.array_equal(sf.segment(twin, 5).labels, sf.segment(mesh, 5).labels)
    for twin in copies_of(graph):
        assert np.array_equal(sf.segment_graph(twin, 5).labels, sf.segment_graph(graph, 5).labels)
    for twin in copies_of(faces):
        assert twin.edge_counts == faces.edge_counts


@pytest.mark.parametrize(("field", "message"), [
    ("faces", r"faces\[0\] refers to vertex 2000000000 but the mesh has 81 vertices"),
    ("neighbors", r"neighbors\[0\] must be 0 to 127, got 2000000000"),
    ("offsets", "offsets must increase from 0 to 352, the number of arcs"),
])  # fmt: skip
def test_a_pickle_with_other_numbers_is_checked(field, message, graph):
    mesh = shapes.bumpy_sheet(8)
    original = mesh if field == "faces" else graph
    state = dict(original.__dict__)
    state[field] = np.full_like(state[field], OUT_OF_RANGE)
    forged = object.__new__(type(original))
    with pytest.raises(ValueError, match=message):
        forged.__setstate__(state)


@pytest.mark.parametrize("state", [None, {}, {"vertices": np.zeros((3, 3))}])
def test_a_pickle_without_its_arrays_is_refused(state):
    for kind, fields in (
        (Mesh, "vertices, faces"),
        (CellGraph, "weight_unit, arc_measures, dimension"),
    ):
        message = f"the copy or pickle is damaged: it must have the fields {fields}"
        with pytest.raises(ValueError, match=message):
            object.__new__(kind).__setstate__(state)


def test_a_thread_that_writes_the_faces_meanwhile_finds_an_error_or_labels():
    vertices, faces = np.array(shapes.bumpy_sheet(60).vertices), shapes.bumpy_sheet(60).faces
    shared = np.array(faces)
    is_done = threading.Event()

    def write():
        while not is_done.is_set():
            shared[0, 0] = OUT_OF_RANGE
            shared[0, 0] = faces[0, 0]

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(20):
            try:
                assert sf.segment((vertices, shared), 10).n_segments == 10
            except MeshError as error:
                assert "faces[0] refers to vertex" in str(error)  # noqa: PT017 - either may be
    finally:
        is_done.set()
        writer.join()


MAPPED = """
import os, sys
import numpy as np
import superfacets as sf
mesh = sf.sample_mesh(5000)
folder = sys.argv[1]
for name in ("vertices", "faces"):
    np.save(f"{folder}/{name}.npy", getattr(mesh, name))
arrays = [np.load(f"{folder}/{name}.npy", mmap_mode="r") for name in ("vertices", "faces")]
mapped = sf.Mesh(*arrays)
viewed = sf.Mesh(np.frombuffer(arrays[0]._mmap, np.float64, offset=128).reshape(-1, 3), arrays[1])
for name in ("vertices", "faces"):
    os.truncate(f"{folder}/{name}.npy", 0)
labels = sf.segment(mesh, 20).labels
for other in (mapped, viewed):
    assert np.array_equal(sf.segment(other, 20).labels, labels)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not cut a file that is mapped")
def test_a_memory_map_whose_file_is_cut_does_no_harm(tmp_path):
    subprocess.run([sys.executable, "-c", MAPPED, str(tmp_path)], check=True)


def masked(values):
    array = np.ma.array(values)
    array[(0,) * array.ndim] = np.ma.masked
    return array


def test_masked_entries_are_refused(graph, tmp_path):
    mesh = shapes.bumpy_sheet(4)
    ones = np.ones(mesh.n_faces, int)
    calls = [
        lambda: Mesh(masked(mesh.vertices), mesh.faces),
        lambda: Mesh(mesh.vertices, masked(mesh.faces)),
        lambda: sf.segment(mesh, init=masked([1, 2])),
        lambda: sf.segment(mesh, weights=masked(np.ones(sf.build_face_graph(mesh).n_arcs))),
        lambda: sf.metrics.compactness(mesh, masked(ones)),
        lambda: sf.enforce_connectivity(mesh, masked(ones - 1)),
        lambda: sf.pool(ones - 1, masked(ones)), lambda: sf.unpool(ones - 1, masked(ones)),
        lambda: sf.vertex_labels(mesh, masked(ones)),
        lambda: sf.transfer(mesh, ones, masked(mesh.vertices)),
        lambda: sf.metrics.area_overlap(ones, ones, masked(ones * 1.0)),
        lambda: sf.write_labels(tmp_path / "a.npy", masked(ones)),
        lambda: sf.write_mesh(tmp_path / "a.ply", mesh, colors=masked(np.ones((32, 3), np.uint8))),
        lambda: CellGraph(**(arrays_of(graph) | {"weights": masked(graph.weights)})),
        lambda: CellGraph(**(arrays_of(graph) | {"measures": masked(graph.measures)})),
        lambda: CellGraph(**(arrays_of(graph) | {"neighbors": masked(graph.neighbors)})),
    ]  # fmt: skip
    for call in calls:
        with pytest.raises(
            ValueError, match="must not have masked entries: fill or remove these entries"
        ):
            call()
    foreign = type("Foreign", (), {"vertices": masked(mesh.vertices), "faces": mesh.faces})
    with pytest.raises(
        MeshError, match="vertices must not have masked entries: fill or remove these entries"
    ):
        sf.segment(foreign, 2)


def test_masked_colors_of_a_picture_are_refused(tmp_path):
    pytest.importorskip("pyvista")
    mesh = shapes.bumpy_sheet(4)
    with pytest.raises(
        ValueError, match="colors must not have masked entries: fill or remove these entries"
    ):
        sf.plot(mesh, colors=masked(np.ones((32, 3), np.uint8)))


def test_a_masked_array_without_masked_entries_is_an_array():
    mesh = shapes.bumpy_sheet(4)
    plain = Mesh(np.ma.array(mesh.vertices), np.ma.array(mesh.faces, mask=False))
    assert type(plain.faces) is np.ndarray
    assert np.array_equal(plain.faces, mesh.faces)


@pytest.mark.skipif(np.finfo(np.longdouble).maxexp <= 1024, reason="longdouble is float64 here")
def test_numbers_beyond_float64_are_infinite_without_a_warning(graph):
    huge = np.full((3, 3), np.finfo(np.longdouble).max)
    arrays = arrays_of(graph)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(MeshError, match=r"vertices\[0\] must be finite, got \[inf, inf, inf\]"):
            Mesh(huge, [[0, 1, 2]])
        with pytest.raises(
            ValueError, match=r"positions\[0\] must be finite, got \[inf, inf, inf\]"
        ):
            CellGraph(huge, [1] * 3, [0] * 4, [], [])
        with pytest.raises(
            ValueError, match=r"weights\[0\] must be finite and not negative, got inf"
        ):
            CellGraph(**(arrays | {"weights": np.full(graph.n_arcs, huge[0, 0])}))
        with pytest.raises(ValueError, match="bounds must be"):
            CellGraph(**(arrays | {"bounds": [[0, 0, 0], huge[0]]}))
