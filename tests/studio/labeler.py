"""A simulated user who labels a mesh in the studio and knows the true label of each cell."""

import numpy as np

from superfacets.kit import sums_by_label
from superfacets_studio.labels.classes import INSTANCES

N_OF_STROKE = 3
"""Number of cells in a stroke of a split."""


class Labeler:
    """Labels with the operations of the mouse, and counts the strokes.

    A stroke is a press of the button: a click on a region or cell, or one side of a split. Choosing
    a class, or beginning an object, is a key, which is counted separately.

    Parameters
    ----------
    document : Document
    truth : ndarray of int, shape (N,)
        Class of each cell, from 1.
    objects : ndarray of int, shape (N,), optional
        Object of each cell within its class, from 1.
    """

    def __init__(self, document, truth, objects=0):
        self.document, self.truth = document, truth
        self.instances = truth * INSTANCES + objects
        self.n_strokes = self.n_keys = 0

    def label(self, purity):
        """Paint all regions; first split those whose largest object has less than this share."""
        self._split_mixed(purity)
        winners, _ = self._majorities()
        for number in np.unique(winners):
            self.n_keys += 1
            for region in np.flatnonzero(winners == number):
                self._paint(self.document.revision.cells_of(int(region)), number)

    def brush(self, n_strokes):
        """Paint wrong cells, the largest first, one stroke each, until `n_strokes` in total."""
        wrong = np.flatnonzero(self.document.instances != self.instances).astype(np.uint32)
        wrong = wrong[np.argsort(-self.document.areas[wrong], kind="stable")]
        wrong = np.sort(wrong[: max(0, n_strokes - self.n_strokes)])
        for number in np.unique(self.instances[wrong]):
            self._paint(wrong[self.instances[wrong] == number], number)
            self.n_keys += 1
            self.n_strokes -= 1
        self.n_strokes += len(wrong)

    def mean_iou(self):
        """Return the mean IoU, by area, of all objects of the truth."""
        return self._mean_iou(self.document.instances, self.instances)

    def mean_class_iou(self):
        """Return the mean IoU, by area, of all classes of the truth."""
        return self._mean_iou(self.document.state.classes, self.truth)

    def _mean_iou(self, found, truth):
        areas, ious = self.document.areas, []
        for number in np.unique(truth):
            both, one = (found == number) & (truth == number), (found == number) | (truth == number)
            ious.append(areas[both].sum() / areas[one].sum())
        return float(np.mean(ious))

    def _split_mixed(self, purity):
        """Split each mixed region with two strokes, between its two largest objects."""
        _, shares = self._majorities()
        for region in np.flatnonzero(shares < purity):
            cells = self.document.revision.cells_of(int(region))
            strokes = self._strokes_in(cells)
            self.document.split(int(region), self.document.revision.number, *strokes)
            self.n_strokes += 2

    def _strokes_in(self, cells):
        """Return a few cells of each of a region's two largest parts, far from the other part."""
        numbers, truth = np.unique(self.instances[cells], return_inverse=True)
        positions = self.document.segmenter.surface.positions[cells]
        areas = np.bincount(truth, self.document.areas[cells], len(numbers))
        strokes = []
        for rank in np.argsort(-areas)[:2]:
            is_part = truth == rank
            center = positions[is_part].mean(axis=0)
            away = center - positions[~is_part].mean(axis=0)
            heights = (positions[is_part] - center) @ away
            chosen = np.argsort(-heights, kind="stable")[:N_OF_STROKE]
            strokes.append(np.sort(cells[is_part][chosen]))
        return strokes

    def _majorities(self):
        """Return the object with the largest part of each region, and its share of the area."""
        revision, areas = self.document.revision, self.document.areas
        numbers, truth = np.unique(self.instances, return_inverse=True)
        pairs = revision.labels.astype(np.int64) * len(numbers) + truth
        table = sums_by_label(pairs, areas, revision.n_regions * len(numbers))
        table = table.reshape(revision.n_regions, len(numbers))
        return numbers[table.argmax(axis=1)], table.max(axis=1) / table.sum(axis=1)

    def _paint(self, cells, number):
        number, place = divmod(int(number), INSTANCES)
        self.document.paint(cells, number, objects=place)
        self.n_strokes += 1
