"""Signatures of public functions: one order of arguments, one set of defaults."""

import inspect
from itertools import combinations

import numpy as np
import pytest
from shapes import bumpy_sheet

import superfacets as sf
from superfacets import metrics

FUNCTIONS = {
    name: getattr(home, name)
    for home in (sf, metrics)
    for name in home.__all__
    if inspect.isfunction(getattr(home, name))
}
SIGNATURES = {name: inspect.signature(function) for name, function in FUNCTIONS.items()}

PATHS = {"path", "output", "folder"}
MESHES = {"mesh", "cloud", "graph"}
LABELS = {"labels", "vertex_labels"}

LABELS_LATER = {"hierarchy"}
"""Functions whose labels are an option: without them, `hierarchy` segments the mesh itself."""

OWN_DEFAULTS = {("batch", "features"), ("place_seeds", "init")}
"""Defaults that differ: features of files are a list of names, and only the functions that have a
mesh choose between two methods of seeding."""

OF_PAPER = {"alpha", "eta_convex", "init", "max_num_iter", "islands"}
"""Parameters whose defaults are part of the published algorithm."""

VERBS = {
    "Bisect", "Change", "Combine", "Compare", "Compute", "Convert", "Copy", "Cut", "Divide",
    "Estimate", "Label", "Merge", "Read", "Remove", "Return", "Segment", "Store", "Straighten",
    "Transfer", "Write", "Yield",
}  # fmt: skip

LOOPS = {
    "segment": sf.segment, "segment_graph": sf.segment_graph, "paper": sf.paper.segment,
    "place_seeds": sf.place_seeds, "hierarchy": sf.hierarchy, "prepare": sf.prepare,
    "batch": sf.batch,
}  # fmt: skip

SHEET = bumpy_sheet(4)
LABEL_ROW = np.zeros(SHEET.n_faces, int)


def place_of(name):
    """Return the place of a parameter: 0 for paths of outputs, 1 for meshes, 2 for labels."""
    places = (PATHS, MESHES, LABELS)
    return next((i for i, names in enumerate(places) if name in names), len(places))


@pytest.mark.parametrize("name", SIGNATURES)
def test_the_mesh_comes_first_then_labels_then_the_rest(name):
    parameters = list(SIGNATURES[name].parameters.values())
    positional = [each.name for each in parameters if each.kind is not each.KEYWORD_ONLY]
    positional = [each for each in positional if each != "options"]
    is_writer = name.startswith(("write_", "group_", "regroup_"))
    assert (positional[0] in PATHS) == (is_writer or name.startswith("read_"))
    if positional[-1] == "output":  # `plot` returns the picture, and also writes it
        positional.pop()
    places = [place_of(each) for each in positional]
    assert places == sorted(places)
    assert len(positional) <= 4
    later = [each.name for each in parameters if not isinstance(each.default, bool)]
    assert not {*later} & LABELS - {*positional} or name in LABELS_LATER


@pytest.mark.parametrize(("one", "other"), [*combinations(LOOPS, 2)])
def test_equal_names_have_equal_defaults(one, other):
    first, second = (inspect.signature(LOOPS[name]).parameters for name in (one, other))
    for name in first.keys() & second.keys():
        by_design = {(one, name), (other, name)} & OWN_DEFAULTS
        if not by_design and not ("paper" in (one, other) and name in OF_PAPER):
            assert first[name].default == second[name].default, name


def test_segment_is_small():
    assert len(SIGNATURES["segment"].parameters) <= 17
    assert len(inspect.getdoc(sf.segment).splitlines()) <= 90
    assert "{weights}" not in inspect.getdoc(sf.segment)


@pytest.mark.parametrize("name", [*sf.__all__, *metrics.__all__])
def test_the_first_line_of_each_docstring_says_the_result(name):
    """Presets have a docstring below their definition, which the API page shows."""
    value = getattr(sf, name, None) or getattr(metrics, name)
    line = "Presets." if name == "SCANS" else inspect.getdoc(value).partition("\n")[0]
    assert line.endswith(".")
    assert not inspect.isfunction(value) or line.split()[0].strip(",") in VERBS


WRONG = {
    "labels for a mesh": (lambda: sf.region_graph(LABEL_ROW, SHEET), "a mesh, got labels"),
    "a mesh for labels": (lambda: sf.pool(SHEET, LABEL_ROW), "labels, got a mesh"),
    "a pair for labels": (
        lambda: sf.unpool((SHEET.vertices, SHEET.faces), LABEL_ROW), "labels, got a mesh",
    ),
    "a path last": (lambda: sf.write_mesh(SHEET, "a.ply"), "a path, got a mesh"),
    "a folder last": (lambda: sf.write_regions(SHEET, LABEL_ROW, "a"), "a path, got a mesh"),
    "a path for labels": (lambda: sf.view(SHEET, "a.npy"), "labels, got a path"),
    "a result for a mesh": (
        lambda: sf.metrics.compactness(sf.segment(SHEET, 2), SHEET), "a mesh, got labels",
    ),
}  # fmt: skip


def test_results_of_other_functions_are_named_by_their_class():
    result = sf.segment(SHEET, 2)
    merged = sf.merge_small_regions(SHEET, result.labels, 0)
    for given in (result.regions, merged, sf.hierarchy(SHEET, [2]), sf.MeshAttributes()):
        name = type(given).__name__
        with pytest.raises(TypeError, match=f"^expected a mesh, got {name}$"):
            sf.hierarchy(given, [1])
        hint = ": pass its .labels" if hasattr(given, "labels") else ""
        with pytest.raises(TypeError, match=f"^expected labels, got {name}{hint}$"):
            sf.region_graph(SHEET, given)
        with pytest.raises(TypeError, match=f"^expected a path, got {name}$"):
            sf.write_mesh(given, SHEET)
    with pytest.raises(TypeError, match=r"^expected a mesh, got Prepared: pass its \.source$"):
        sf.hierarchy(sf.prepare(SHEET), [1])


@pytest.mark.parametrize("case", WRONG)
def test_arguments_in_the_wrong_order_are_named(case):
    call, words = WRONG[case]
    order = "the (path comes first, then the mesh, then|mesh comes first, then) the labels"
    with pytest.raises(TypeError, match=rf"^expected {words}: {order}$"):
        call()
