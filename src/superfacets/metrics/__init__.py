"""Metrics that rate labels of cells or vertices, with or without ground truth.

- `evaluate` computes all metrics of labels of cells. Use `GroundTruths` to evaluate many labels of
  one mesh. `evaluate_vertices` computes metrics of labels of vertices.
- Metrics of the overlap of regions with true segments (`area_overlap`):
  `undersegmentation_error`, `achievable_accuracy`, `achievable_iou`, `hamming_distance`,
  `rand_index`, `consistency_error`.
- Metrics of borders: `boundary_agreement` (recall and precision), `cut_discrepancy`.
- Metrics without ground truth: `compactness`, `explained_variation`.
"""

from .cuts import BoundaryAgreement, boundary_agreement, cut_discrepancy
from .evaluation import GroundTruths, evaluate, evaluate_vertices
from .overlap import (
    Consistency,
    Hamming,
    Overlap,
    achievable_accuracy,
    achievable_iou,
    area_overlap,
    consistency_error,
    hamming_distance,
    rand_index,
    undersegmentation_error,
)
from .shape import compactness, explained_variation

__all__ = [
    "BoundaryAgreement",
    "Consistency",
    "GroundTruths",
    "Hamming",
    "Overlap",
    "achievable_accuracy",
    "achievable_iou",
    "area_overlap",
    "boundary_agreement",
    "compactness",
    "consistency_error",
    "cut_discrepancy",
    "evaluate",
    "evaluate_vertices",
    "explained_variation",
    "hamming_distance",
    "rand_index",
    "undersegmentation_error",
]
