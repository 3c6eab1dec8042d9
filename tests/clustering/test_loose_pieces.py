"""Regions become connected: pieces without the center join a neighboring region."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.paper import superfacet_weights


def joined(graph, labels, centers, crease_limit=np.inf):
    labels, centers = np.asarray(labels, np.int32), np.asarray(centers, np.int32)
    arcs = (graph.offsets, graph.neighbors, graph.lengths)
    return _core.join_loose_pieces(*arcs, crease_limit, labels, centers, 2).tolist()


LINE = shapes.line_graph([1.0] * 7)


def test_whole_regions_stay():
    labels = [0, 0, 0, 1, 1, 2, 2, 2]
    assert joined(LINE, labels, [1, 3, 7]) == labels


def test_a_piece_without_the_center_joins_its_neighbors_from_both_ends():
    assert joined(LINE, [0, 1, 0, 0, 0, 0, 2, 2], [0, 1, 6]) == [0, 1, 1, 1, 2, 2, 2, 2]


def test_the_shorter_arc_wins_and_the_lower_label_among_equals():
    alike, shorter = [2.0, 2.0], [2.0, 1.0]
    for steps, expected in ((alike, 0), (shorter, 1)):
        line = shapes.line_graph([*steps, 1.0])  # cells 0 to 3; cell 1 is a piece of region 2
        assert joined(line, [0, 2, 1, 2], [0, 2, 3]) == [0, expected, 1, 2]


def test_arcs_above_the_crease_limit_wait_for_all_others():
    """A piece of two cells takes two rounds, because only one has a short arc to another region."""
    line = shapes.line_graph([1.0, 9.0, 1.0, 1.0, 1.0])
    labels, centers = [0, 0, 1, 1, 2, 1], [0, 5, 4]
    between = (line.lengths[2] + line.lengths[1]) / 2
    assert joined(line, labels, centers) == [0, 0, 0, 2, 2, 1]
    assert joined(line, labels, centers, between) == [0, 0, 2, 2, 2, 1]
    short = shapes.line_graph([1.0, 9.0, 1.0])
    assert joined(short, [0, 0, 1, 2], [0, 3, 2], between) == [0, 0, 1, 2]
    assert joined(shapes.line_graph([1.0, 9.0]), [0, 1, 0], [0, 1], 0.0) == [0, 1, 1]


def test_pieces_pass_through_other_loose_pieces():
    """Cells 3 to 5 are two loose pieces; the inner one is reached in the second round."""
    line = shapes.line_graph([1.0] * 6)
    assert joined(line, [0, 1, 2, 0, 1, 0, 1], [0, 1, 2]) == [0, 1, 2, 2, 2, 2, 2]


def test_cells_without_a_label_stay_and_divide_regions():
    assert joined(LINE, [0, 0, -1, 0, 0, 1, 1, 1], [1, 6]) == [0, 0, -1, 1, 1, 1, 1, 1]
    assert joined(LINE, [0, 0, -1, 0, 0, -1, 1, 1], [1, 6]) == [0, 0, -1, 0, 0, -1, 1, 1]


def test_a_piece_is_found_where_a_cell_without_a_label_makes_up_for_it():
    """If unlabeled cells reduced the count, there would be as many pieces as centers."""
    line = shapes.line_graph([1.0] * 4)
    assert joined(line, [0, 1, 0, -1, -1], [0, 1]) == [0, 1, 1, -1, -1]


def random_case(seed):
    """Return random labels, often equal at neighbors, on a sheet with holes or a random graph."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        sheet = shapes.bumpy_sheet(12, seed)
        sheet = sf.Mesh(sheet.vertices, sheet.faces[rng.random(sheet.n_faces) < 0.85])
        graph = sf.build_face_graph(sheet)
        graph = graph.with_weights(superfacet_weights(sheet, graph))
    else:
        graph = shapes.random_graph(150, 300, seed, weight_values=[1.0, 2.0])
    n_labels = int(rng.integers(1, 20))
    labels = rng.integers(0, n_labels, graph.n_cells)
    for _ in range(3):
        takes = rng.integers(0, graph.n_arcs, graph.n_cells)
        labels[graph.sources[takes]] = labels[graph.neighbors[takes]]
    _, labels = np.unique(labels, return_inverse=True)
    n_labels = labels.max() + 1
    centers = np.array([rng.choice(np.flatnonzero(labels == label)) for label in range(n_labels)])
    labels[rng.random(graph.n_cells) < (seed % 3) / 10] = -1
    labels[centers] = np.arange(n_labels)
    return graph, labels.astype(np.int32), centers.astype(np.int32)


def twin(graph, labels, centers, crease_limit):
    """Reference: join pieces round by round, as specified."""
    arcs = list(zip(graph.sources.tolist(), graph.neighbors.tolist(), graph.lengths.tolist(),
                    strict=True))  # fmt: skip
    found = labels.tolist()
    settled = set(centers.tolist())
    grown = settled
    while grown:  # grow the pieces that contain centers
        grown = {b for a, b, _ in arcs if a in settled and found[a] == found[b]} - settled
        settled |= grown
    while True:
        offers = {}
        for a, b, length in arcs:
            if found[a] >= 0 and a not in settled and b in settled:
                offer = (length >= crease_limit, length, found[b])
                offers[a] = min(offers.get(a, (True, np.inf, 0)), offer)
        if not offers:
            return found
        if not all(waits for waits, *_ in offers.values()):
            offers = {cell: offer for cell, offer in offers.items() if not offer[0]}
        for cell, (*_, label) in offers.items():
            found[cell] = label
        settled |= offers.keys()


@pytest.mark.parametrize("seed", range(40))
def test_results_equal_the_twin_and_regions_are_one_piece_where_they_can_be(seed):
    graph, labels, centers = random_case(seed)
    crease_limit = np.inf if seed % 4 < 2 else np.median(graph.lengths)
    found = np.array(joined(graph, labels, centers, crease_limit))
    assert found.tolist() == twin(graph, labels, centers, crease_limit)
    assert np.array_equal(found < 0, labels < 0)
    assert np.array_equal(found[centers], np.arange(len(centers)))
    pieces, _ = _core.find_components(graph.offsets, graph.neighbors, labels)
    is_whole = (labels >= 0) & (pieces == pieces[centers][labels])
    assert np.array_equal(found[is_whole], labels[is_whole])
    is_kept = (labels >= 0).astype(np.int32)
    parts, _ = _core.find_components(graph.offsets, graph.neighbors, is_kept)
    reachable = (labels >= 0) & np.isin(parts, parts[centers])
    pieces, _ = _core.find_components(graph.offsets, graph.neighbors, found.astype(np.int32))
    assert (pieces == pieces[centers][found])[reachable].all()


def test_random_cases_have_loose_pieces():
    """Otherwise, the test above would check nothing."""
    n_changed = [
        np.count_nonzero(np.array(joined(graph, labels, centers)) != labels)
        for graph, labels, centers in map(random_case, range(40))
    ]
    assert np.count_nonzero(n_changed) > 30


@pytest.mark.parametrize("is_shuffled", [False, True])
@pytest.mark.parametrize("n_threads", [1, 3])
def test_pieces_of_large_graphs_extend_over_blocks_of_cells(is_shuffled, n_threads):
    """Three pieces of a line of 60,000 cells, which are numbered along the line or randomly."""
    n, first, last = 60_000, 20_000, 59_900
    numbers = np.arange(n, dtype=np.int32)
    order = np.random.default_rng(5).permutation(numbers) if is_shuffled else numbers
    sources = np.concatenate([order[:-1], order[1:]])
    by_source = np.argsort(sources, kind="stable")
    offsets = np.searchsorted(sources[by_source], np.arange(n + 1)).astype(np.int64)
    targets = np.concatenate([order[1:], order[:-1]])[by_source]
    labels = np.empty(n, np.int32)
    labels[order] = (numbers >= first) & (numbers < last)
    lengths, centers = np.ones(len(sources), np.float32), order[[0, first]]
    found = _core.join_loose_pieces(offsets, targets, lengths, np.inf, labels, centers, n_threads)
    assert np.array_equal(found[order], numbers >= first)
