"""Encode the data by which a page colors cells: regions, ground truth, and values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from superfacets import BorderCut
from superfacets.kit import Cells, Floats, Ints, Longs, compact_partial_labels, refuse_mask

from ..colors import checked_values, region_colors
from .coding import Arrays
from .shape import DrawnSurface

NO_REGION = -1
NO_VALUE = 65535
"""Code of a missing value (NaN). Other values are quantized to 0 to 65534."""


@runtime_checkable
class HasLevels(Protocol):
    """Interface of `Hierarchy`, which this module must not import: it is in a higher layer."""

    @property
    def levels(self) -> list[Ints]:
        """Labels of each level, one array per level."""

    def cut(self, n: int) -> Ints:
        """Labels of the level with n regions. `Segmentation` has no such method."""


LabelsLike = npt.ArrayLike | HasLevels | Sequence[npt.ArrayLike]


@dataclass(frozen=True)
class Labeling:
    """Labels of cells, renumbered to 0 to K - 1; -1 for cells without a region."""

    labels: Ints
    ids: Longs  # (K,) original label of each region
    drawn: Ints  # label of each drawn cell: `labels`, or the labels of parts of faces

    @property
    def n_regions(self) -> int:
        """Number of regions, K."""
        return len(self.ids)

    def facts(self, shape: DrawnSurface) -> dict[str, Any]:
        """Return a description of the regions, for the JavaScript viewer."""
        is_numbered = np.array_equal(self.ids, np.arange(self.n_regions))
        area = float(shape.areas.sum()) / shape.diagonal**2
        return {
            "ids": None if is_numbered else self.ids.tolist(),
            "n_left_out": int(np.count_nonzero(self.labels == NO_REGION)),
            "mean_area": area / max(1, self.n_regions),  # in squared diagonals of the bounding box
        }

    def add_to(
        self, arrays: Arrays, name: str, shape: DrawnSurface, finer: Labeling | None
    ) -> None:
        """Add labels, colors, cell counts, and areas or volumes of the regions to `arrays`.

        The names of the arrays begin with `name`. If each region of `finer` is inside a single
        region of this labeling, the label of each cell is not stored. Instead, the region that
        contains each region of `finer` is stored.
        """
        parents = None if finer is None else self._parents(finer)
        if parents is None:
            arrays.add(f"{name}_labels", self.drawn.view(np.uint32), "planes")
        else:
            arrays.add(f"{name}_parents", parents.view(np.uint32), "planes")
        is_in = self.labels != NO_REGION
        inside = self.labels[is_in]
        counts = np.bincount(inside, minlength=self.n_regions)
        sizes = np.bincount(inside, shape.graph.measures[is_in], minlength=self.n_regions)
        arrays.add(f"{name}_colors", region_colors(shape.graph.arcs, self.labels).ravel(), "planes")
        arrays.add(f"{name}_counts", counts.astype(np.uint32), "planes")
        arrays.add(f"{name}_sizes", sizes.astype(np.float32), "planes")

    def along(self, cut: BorderCut, finest: Labeling) -> Labeling:
        """Return the labeling to be drawn on faces that are cut along borders of `finest`."""
        parents = self._parents(finest)
        if parents is None:
            return replace(self, drawn=self.labels[cut.sources])
        return replace(self, drawn=np.append(parents, np.int32(NO_REGION))[cut.labels])

    def _parents(self, finer: Labeling) -> Ints | None:
        """Return the region that contains each region of `finer`; None if regions are not nested.

        The result is also None if the two labelings leave out different cells.
        """
        if not np.array_equal(self.labels == NO_REGION, finer.labels == NO_REGION):
            return None
        parents = np.empty(finer.n_regions + 1, np.int32)  # the last entry is for label -1
        parents[finer.labels] = self.labels
        if not np.array_equal(parents[finer.labels], self.labels):
            return None
        return parents[:-1]


@dataclass(frozen=True)
class Feature:
    """A named array with one value per cell, or one value per region of the first level."""

    name: str
    values: Floats  # NaN for missing values
    of: str  # "cell" for one value per cell, "region" for one value per region

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest value; (0, 0) if all values are missing."""
        known = self.values[~np.isnan(self.values)]
        return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)

    def facts(self) -> dict[str, Any]:
        """Return a description of the values, for the JavaScript viewer."""
        low, high = self.range
        n_missing = int(np.count_nonzero(np.isnan(self.values)))
        return {
            "name": self.name, "of": self.of, "low": low, "high": high, "n_missing": n_missing,
        }  # fmt: skip

    def steps(self) -> npt.NDArray[np.uint16]:
        """Return the values, quantized to 0 (lowest) to 65534 (highest); `NO_VALUE` for NaN.

        If all values are equal, they become 32767.
        """
        low, high = self.range
        shares = (self.values - low) / (high - low) if high > low else self.values * 0 + 0.5
        is_missing = np.isnan(shares)
        steps = np.rint(np.where(is_missing, 0, shares) * (NO_VALUE - 1)).astype(np.uint16)
        return np.where(is_missing, np.uint16(NO_VALUE), steps)


def checked_levels(
    labels: LabelsLike | None, n_cells: int, n_vertices: int | None = None
) -> list[Labeling]:
    """Check labels of one or several levels; return one `Labeling` per level.

    The result is an empty list if `labels` is None.
    """
    if labels is None:
        return []
    given: Any = labels.levels if isinstance(labels, HasLevels) else labels
    refuse_mask(given, "labels")
    if isinstance(given, (list, tuple)) and given and np.ndim(given[0]) == 1:
        return [checked_labeling(level, n_cells, n_vertices) for level in given]
    array = np.asarray(given)
    return [
        checked_labeling(level, n_cells, n_vertices)
        for level in (array if array.ndim == 2 else [given])
    ]


def checked_labeling(labels: Any, n_cells: int, n_vertices: int | None) -> Labeling:
    """Check the labels of cells, and return them with regions renumbered without gaps."""
    compact, ids = compact_partial_labels(labels, n_cells, n_vertices)
    return Labeling(compact, ids, compact)


def checked_features(
    features: Mapping[str, npt.ArrayLike] | None, cells: Cells, n_regions: int | None
) -> list[Feature]:
    """Check the argument `features` of `view`; return one `Feature` per named array.

    `n_regions` is the number of regions of the first level, or None if there are no labels.
    """
    found = []
    for name, given in (features or {}).items():
        values, of = checked_values(given, f"feature {name!r}", cells, n_regions)
        found.append(Feature(str(name), values, of))
    return found
