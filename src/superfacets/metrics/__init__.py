"""Metrics that rate labels of cells or vertices, with or without ground truth.

- `evaluate` computes all metrics of labels of cells. Use `GroundTruths` to evaluate many labels of
  one mesh. `evaluate_vertices` computes metrics of labels of vertices.
- Metrics of the overlap of regions with true segments (`area_overlap`), for cells of any kind:
  `undersegmentation_error`, `achievable_accuracy`, `achievable_iou`.
- `compactness` needs no ground truth.
"""

from .evaluation import GroundTruths, evaluate, evaluate_vertices
from .overlap import (
    Overlap,
    achievable_accuracy,
    achievable_iou,
    area_overlap,
    undersegmentation_error,
)
from .shape import compactness

__all__ = [
    "GroundTruths", "Overlap", "achievable_accuracy", "achievable_iou", "area_overlap",
    "compactness", "evaluate", "evaluate_vertices", "undersegmentation_error",
]  # fmt: skip
