"""A row of numbers for each variant and number of regions on a mesh."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ... import __version__, metrics
from ...cells.face_graph import build_face_graph
from ...pipeline import segment
from ..sources import Source, load_model
from ..tasks import Piece, Record
from .subjects import SCALES, Subject, creases
from .variants import VARIANTS

_RECORD_VERSION = 1  # raised when records hold something else


class Case(NamedTuple):
    """What one row is about."""

    source: Source
    scale: str
    variant: str
    k: int

    def __str__(self) -> str:
        return f"model {self.source.name}, {self.scale}, {self.variant}, k = {self.k}"

    def piece(self, folder: Path) -> Piece:
        """Return the case with its record: ``SCALE/MODEL/VARIANT_k-K.json`` in the folder."""
        scale, variant = (
            "".join(letter if letter.isalnum() else "-" for letter in name)
            for name in (self.scale, self.variant)
        )
        key = {
            "record": _RECORD_VERSION,
            "superfacets": __version__,
            "mesh": self.source.digest,
            "scale": self.scale,
            "variant": [self.variant, dict(VARIANTS[self.variant])],
            "k": self.k,
        }
        path = folder / scale / self.source.name / f"{variant}_k-{self.k}.json"
        return Piece(self, path, key)


@dataclass(frozen=True)
class Task:
    """Cases on one mesh."""

    pieces: tuple[Piece, ...]
    memory: int = 0

    def prepare(self) -> Callable[[Piece], Record]:
        """Load the model, scale it, and find its creases."""
        first: Case = self.pieces[0].subject
        model = load_model(first.source)
        subject = SCALES[first.scale](Subject(model.mesh, model.ground_truths))
        surface = metrics.GroundTruths(subject.mesh, (), n_threads=1)  # what labels have in common
        areas = build_face_graph(subject.mesh).measures
        valleys, ridges = creases(subject.mesh)
        _labels(subject, first)  # to warm up

        def measure(piece: Piece) -> Record:
            case: Case = piece.subject
            start = time.process_time()  # what others do on the machine does not count
            labels = _labels(subject, case)
            seconds = time.process_time() - start
            values = metrics.evaluate(subject.mesh, labels, surface)
            return {
                "model": case.source.number,
                "scale": case.scale,
                "faces": subject.mesh.n_faces,
                "variant": case.variant,
                "k": case.k,
                "ue": _mean_error(labels, subject.truths, areas),
                "compactness": values["compactness"],
                "valleys": valleys.share_between(labels),
                "ridges": ridges.share_between(labels),
                "regions": int(values["n_regions"]),
                "extra_pieces": int(values["n_extra_pieces"]),
                "seconds": seconds,
            }

        return measure


def _labels(subject: Subject, case: Case) -> npt.NDArray[np.int32]:
    options: dict[str, Any] = dict(VARIANTS[case.variant])
    return segment(subject.mesh, case.k, n_threads=1, **options).labels


def _mean_error(
    labels: npt.NDArray[np.int32],
    truths: Iterable[npt.NDArray[np.int32]],
    areas: npt.NDArray[np.float64],
) -> float:
    overlaps = [metrics.area_overlap(labels, truth, areas) for truth in truths]
    return float(np.mean([metrics.undersegmentation_error(overlap) for overlap in overlaps]))
