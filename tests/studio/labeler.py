"""A person who labels a mesh in the studio, and knows where each cell belongs."""

import numpy as np

from superfacets.cells.sums import sums_by_label

N_OF_STROKE = 3
"""Cells that a stroke of a split goes over."""


class Labeler:
    """Does what can be done with a mouse, and counts the strokes.

    A stroke is a press of the button: a click on a region or cell, or one side of a split. Choosing
    a class is a key, which is counted apart.

    Parameters
    ----------
    document : Document
    truth : ndarray of int, shape (N,)
        Class of each cell, 1 and up.
    """

    def __init__(self, document, truth):
        self.document, self.truth = document, truth
        self.n_strokes = self.n_keys = 0

    def label(self, purity):
        """Paint all regions, and split those first of which less than this is of one class."""
        self._split_mixed(purity)
        classes, _ = self._majorities()
        for number in np.unique(classes):
            self.n_keys += 1
            for region in np.flatnonzero(classes == number):
                self._paint(self.document.revision.cells_of(int(region)), number)

    def brush(self, n_strokes):
        """Paint cells that are wrong, the largest first, a stroke each, up to so many in all."""
        wrong = np.flatnonzero(self.document.state.classes != self.truth).astype(np.uint32)
        wrong = wrong[np.argsort(-self.document.areas[wrong], kind="stable")]
        wrong = np.sort(wrong[: max(0, n_strokes - self.n_strokes)])
        for number in np.unique(self.truth[wrong]):
            self.n_keys += 1
            self.document.paint(wrong[self.truth[wrong] == number], int(number))
        self.n_strokes += len(wrong)

    def _split_mixed(self, purity):
        """Split each mixed region by two strokes, along what is the most and the next most."""
        _, shares = self._majorities()
        for region in np.flatnonzero(shares < purity):
            cells = self.document.revision.cells_of(int(region))
            strokes = self._strokes_in(cells)
            self.document.split(int(region), self.document.revision.number, *strokes)
            self.n_strokes += 2

    def _strokes_in(self, cells):
        """A few cells of the two largest parts of a region, those farthest from the other part."""
        truth, positions = self.truth[cells], self.document.segmenter.surface.positions[cells]
        areas = np.bincount(truth, self.document.areas[cells])
        strokes = []
        for number in np.argsort(-areas)[:2]:
            is_part = truth == number
            center = positions[is_part].mean(axis=0)
            away = center - positions[~is_part].mean(axis=0)
            heights = (positions[is_part] - center) @ away
            chosen = np.argsort(-heights, kind="stable")[:N_OF_STROKE]
            strokes.append(np.sort(cells[is_part][chosen]))
        return strokes

    def _majorities(self):
        """The class that most of each region is, and its share of the area."""
        revision, areas = self.document.revision, self.document.areas
        n_classes = int(self.truth.max()) + 1
        pairs = revision.labels.astype(np.int64) * n_classes + self.truth
        table = sums_by_label(pairs, areas, revision.n_regions * n_classes)
        table = table.reshape(revision.n_regions, n_classes)
        return table.argmax(axis=1), table.max(axis=1) / table.sum(axis=1)

    def _paint(self, cells, number):
        self.document.paint(cells, int(number))
        self.n_strokes += 1
