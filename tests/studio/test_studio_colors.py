"""Default colors of classes differ clearly, as measured by CIEDE2000."""

import numpy as np
import pytest
from ciede2000 import ciede2000, lab

from superfacets_show.colors import VISIONS, from_oklab, seen_as
from superfacets_studio.documents.document import Document
from superfacets_studio.labels.classes import default_classes, new_class

N_COLORS = 100


@pytest.fixture(scope="module")
def colors():
    classes = default_classes([str(i) for i in range(N_COLORS)])
    return np.array([[*bytes.fromhex(entry["color"][1:])] for entry in classes])


@pytest.fixture(scope="module")
def palette(colors):
    return lab(colors)


@pytest.mark.parametrize(("one", "other", "difference"), [  # of Sharma, Wu and Dalal
    ([50, 2.6772, -79.7751], [50, 0, -82.7485], 2.0425),
    ([50, -1, 2], [50, 0, 0], 2.3669),
    ([50, 2.49, -0.001], [50, -2.49, 0.0011], 7.2195),
    ([50, 2.5, 0], [73, 25, -18], 27.1492),
    ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
    ([22.7233, 20.0904, -46.694], [23.0331, 14.973, -42.5619], 2.0373),
    ([2.0776, 0.0795, -1.135], [0.9033, -0.0636, -0.5514], 0.9082),
])  # fmt: skip
def test_differences_are_those_of_the_paper(one, other, difference):
    assert ciede2000(np.array(one), np.array(other)) == pytest.approx(difference, abs=1e-4)


@pytest.mark.parametrize(("n", "least"), [(7, 15), (40, 12), (N_COLORS, 6)])
def test_any_two_of_the_first_colors_differ(palette, n, least):
    assert smallest_difference(palette[:n]) >= least


def smallest_difference(colors):
    return ciede2000(colors[:, None], colors)[np.triu_indices(len(colors), 1)].min()


@pytest.mark.parametrize("vision", VISIONS)
def test_color_blind_people_distinguish_the_first_twelve_colors(colors, vision):
    assert smallest_difference(lab(from_oklab(seen_as(colors[:12], vision)))) >= 8


def test_no_color_looks_like_an_unlabeled_cell(palette):
    grays = lab(np.repeat(np.arange(100, 256, 5), 3).reshape(-1, 3))
    assert ciede2000(palette[:, None], grays).min() >= 12


def test_work_files_keep_the_colors_that_they_have(sheet):
    """The first file has colors of an earlier palette."""
    old = [new_class(1, "a", "#e7298a"), new_class(2, "b", "#0000ff")]
    Document.open(sheet, n_segments=5, classes=old).close()
    again = Document.open(sheet)
    assert [entry["color"] for entry in again.class_list] == ["#e7298a", "#0000ff"]
    again.close()
