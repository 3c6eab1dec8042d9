"""Check the options that apply to each file, segment one file, and write the results."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from .. import paper
from ..base.checks import (
    checked_count,
    checked_flag,
    checked_fraction,
    checked_number,
    checked_threads,
)
from ..base.errors import MeshError
from ..base.options import ANY_INITS, ISLANDS, CountOptions, Sizes
from ..base.timing import Callback, Reports, timed
from ..base.types import Array, Bools, Floats, Longs
from ..clustering.result import Segmentation
from ..files.formats import FORMATS
from ..files.guards import Content, read_content
from ..files.input import Input
from ..files.readers.labels import parse_labels_of
from ..files.readers.read import cell_ending, parse
from ..files.writers.cells import FormatOptions
from ..files.writers.write import OutputFiles, Written
from ..graph.constraints import ConstraintOptions, mask_of, sharp_edges, sharp_edges_inside
from ..graph.kinds import kind_of
from ..graph.point_graph import checked_viewpoint
from ..graph.size import advised_max_edge
from ..mesh.attributes import MeshAttributes
from ..mesh.base import Cells
from ..mesh.convert import as_mesh
from ..mesh.weld import checked_weld
from ..pipeline import segment
from ..stages.options import SegmentOptions
from ..stages.prepare import Prepared, prepare
from ..stages.presets import OTHER_NAMES
from ..weights.features import FEATURE_WEIGHT, Features
from ..weights.formulas import Weights
from .named_features import CellData
from .subdivision import Subdivision, subdivide

Load = Callable[[bool], tuple[Cells, MeshAttributes | None, dict[str, Array]]]
"""Function that reads a file; the argument says whether to read attributes in addition to cells.
Returns the cells, the attributes, and arguments of `segment`: ``mask`` and ``barriers``, if any."""

_ARRAYS = {"mesh", "features", "mask", "barriers", "callback"}
"""Parameters that are not in `FileOptions.keywords`, mostly because they are arrays. The names in
`FileOptions.features` replace the parameter `features`."""


def _defaults_of(function: Callable[..., Segmentation]) -> dict[str, Any]:
    parameters = inspect.signature(function).parameters.items()
    return {name: parameter.default for name, parameter in parameters if name != "mesh"}


_DEFAULTS = {False: _defaults_of(segment), True: _defaults_of(paper.segment)}
"""Default of each parameter of `segment` and of `paper.segment`, keyed by `FileOptions.paper`."""


@dataclass(frozen=True)
class Outcome:
    """Result for one file: the data to write to its output files."""

    mesh: Cells
    attributes: MeshAttributes | None
    result: Segmentation
    listed: Longs | None = None  # labels of the input faces; None if the mesh was not subdivided
    listed_mesh: Cells | None = None  # input mesh; None if the mesh was not subdivided
    sharp_inside: Floats | None = None
    """For each region, the fraction of the length of barrier edges that is inside the region, (K,).
    None if there are no barrier edges, or if no `barrier_angle` was given."""
    warnings: tuple[Warning, ...] = ()  # warnings of `segment`
    constraints: Mapping[str, Any] = field(default_factory=dict)  # mask and barriers, as given

    def write(self, outputs: OutputFiles) -> Written:
        """Write all outputs, and return the same as `OutputFiles.write`."""
        return outputs.write(
            self.mesh, self.result.labels, attributes=self.attributes, listed=self.listed,
            listed_mesh=self.listed_mesh, constraints=self.constraints,
            weld=self.result.params.get("weld", True),
        )  # fmt: skip


@dataclass(frozen=True)
class FileOptions:
    """Checked options that apply to each file; they are parameters of `batch`.

    Commands make them from their options, and then call `segment` or `segment_to_files`.
    """

    CHOICES: ClassVar[Mapping[str, tuple[str, ...]]] = {"init": ANY_INITS, "islands": ISLANDS}
    """Allowed names of the options `init` (of `paper.segment`) and `islands`."""

    keywords: Mapping[str, Any]  # keyword arguments of `segment` that are not None
    features: str | Sequence[str] | Features = ()  # names
    subdivide: bool = False
    max_edge: float | None = None
    drop_attributes: bool = False
    ascii: bool = False
    label_name: str = "label"
    vertex_labels: bool = False
    force: bool = False
    viewpoint: Sequence[float] | None = None
    min_opacity: float = 0.0
    mask_values: Sequence[int] = ()  # empty if there is no mask
    labels_named: str = "label"
    paper: bool = False  # whether `keywords` are arguments of `paper.segment`
    weld: float = True  # same as in `prepare`

    def __post_init__(self) -> None:
        is_paper = checked_flag(self.paper, "paper")
        given = {name: value for name, value in self.keywords.items() if value is not None}
        _check_keywords(given, is_paper)
        max_edge, viewpoint = self.max_edge, self.viewpoint
        if max_edge is not None:
            max_edge = checked_number(max_edge, "max_edge", zero=False)
        checked: dict[str, Any] = {
            "keywords": given,
            "features": _checked_features(self.features, is_paper),
            "max_edge": max_edge,
            "weld": checked_weld(self.weld),
            "viewpoint": None if viewpoint is None else checked_viewpoint(viewpoint),
            "min_opacity": checked_fraction(self.min_opacity, "min_opacity"),
            "mask_values": tuple(
                checked_count(value, "each of mask_values", low=0) for value in self.mask_values
            ),
        }
        for name in ("subdivide", "drop_attributes", "ascii", "vertex_labels", "force"):
            checked[name] = checked_flag(getattr(self, name), name)
        checked["subdivide"] |= max_edge is not None
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def form(self, endings: Sequence[str]) -> FormatOptions:
        """Return options for output formats; raise an error if one has no effect on any ending."""
        return FormatOptions.checked(
            endings, ascii=self.ascii, label_name=self.label_name,
            vertex_labels=self.vertex_labels, force=self.force,
        )  # fmt: skip

    @property
    def arguments(self) -> dict[str, Any]:
        """Options as keyword arguments of `batch`."""
        own = {each.name: getattr(self, each.name) for each in fields(self)[1:]}
        return {**self.keywords, **own}

    @property
    def params(self) -> dict[str, Any]:
        """Options that affect results and differ from their defaults, as JSON values."""
        usual = {**_DEFAULTS[self.paper], **FileOptions({}).arguments}
        return {
            name: _as_json(value)
            for name, value in sorted(self.arguments.items())
            if name not in ("n_threads", "force") and _as_json(value) != _as_json(usual[name])
        }

    def segment(
        self, load: Load, *, holds_attributes: bool, timings: dict[str, float],
        barrier_angle: float | None = None, callback: Callback | None = None,
    ) -> Outcome:  # fmt: skip
        """Read, subdivide and segment one file, without writing results.

        `holds_attributes` says whether an output file can store attributes. The times of the stages
        "mesh" and "subdivide" are added to `timings`. `barrier_angle` is the angle of the
        `sharp_edges` that are barriers.
        """
        keeps, wanted = not self.drop_attributes and holds_attributes, Features.of(self.features)
        threads = checked_threads(self.keywords.get("n_threads"))
        with timed(timings, "mesh", Reports(callback)):
            reads = keeps or bool(wanted.names) or self.min_opacity > 0
            mesh, attributes, constraints = load(reads)
            mesh = kind_of(mesh).seen_from(mesh, self.viewpoint)
            of_cells = self._values_of_cells(mesh, attributes, constraints)
            if attributes is not None and not keeps:
                attributes = MeshAttributes(records=attributes.records)
        parts, given = None, mesh
        if self.subdivide:
            with timed(timings, "subdivide"):
                parts = _subdivided(mesh, self)
            mesh = parts.mesh
            of_cells = {name: values[parts.sources] for name, values in of_cells.items()}
            if attributes is not None:
                attributes = CellData(given, attributes).attributes_of(parts)
        if "features" in of_cells:
            of_cells["features"] = replace(wanted, table=of_cells["features"])
        if barrier_angle is not None:
            of_cells["barriers"] = sharp_edges(as_mesh(mesh), barrier_angle, n_threads=threads)
        result, found = _segmented(mesh, of_cells, self, callback)
        outcome = Outcome(mesh, attributes, result, warnings=found, constraints=constraints)
        if barrier_angle is not None and len(of_cells["barriers"]):
            surface, labels = as_mesh(mesh), result.labels
            inside = sharp_edges_inside(surface, labels, barrier_angle, n_threads=threads)
            outcome = replace(outcome, sharp_inside=inside)
        if parts is None:
            return outcome
        return replace(outcome, listed=parts.labels_back(result.labels), listed_mesh=given)

    def _values_of_cells(
        self, cells: Cells, attributes: MeshAttributes | None, constraints: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Return the arguments of `segment` with a value or row per cell, keyed by name."""
        per_cell = vars(ConstraintOptions(**constraints).per_cell(cells))
        given = {name: values for name, values in per_cell.items() if values is not None}
        data, is_kept = CellData(cells, attributes), constraints.get("mask")
        if self.min_opacity > 0:
            is_kept = _are_opaque(attributes, self.min_opacity) & given.get("mask", True)
            given["mask"] = is_kept
        names, threads = Features.of(self.features).names, self.keywords.get("n_threads")
        table = data.features(names, checked_threads(threads), is_kept)
        return given if table is None else given | {"features": table}

    def segment_to_files(
        self, source: str, files: Sequence[Path], on_content: Callable[[Content | None], None]
    ) -> tuple[Segmentation, dict[str, float], dict[str, str]]:
        """Segment one file, write the results, and return the result, the times, and notes by kind.

        Missing folders are created. `on_content` is called with the content of the file, or with
        None if it cannot be read.
        """
        for folder in {path.parent for path in files}:
            folder.mkdir(parents=True, exist_ok=True)
        outputs = OutputFiles(files, self.form([*OutputFiles(files).endings]))
        outputs.check()
        path = Path(source)

        def load(keep: bool) -> tuple[Cells, MeshAttributes | None, dict[str, Array]]:
            try:
                content = read_content(path)
            except MeshError:  # for example, an empty file
                on_content(None)
                raise
            on_content(content)
            source = Input(content, cell_ending(path), path.parent, keep)
            cells, attributes = parse(source)
            outputs.check_fit(cells)
            constraints: dict[str, Array] = {}
            if self.mask_values:
                labels, _ = parse_labels_of(cells, source, self.labels_named)
                constraints["mask"] = mask_of(labels, self.mask_values, path, cells)
            return cells, attributes, constraints

        timings: dict[str, float] = {}
        holds = not outputs.endings.isdisjoint(FORMATS.attribute_outputs)
        outcome = self.segment(load, holds_attributes=holds, timings=timings)
        with timed(timings, "export"):
            written = outcome.write(outputs)
        notes = {type(one).__name__: str(one) for one in outcome.warnings}
        least = OutputFiles.MIN_VERTICES
        if n_small := int(np.count_nonzero(written.region_sizes < least)):
            notes["small regions"] = f"{n_small} with fewer than {least} vertices"
        if lost := written.notes():
            notes["changed data"] = "; ".join(lost)
        return outcome.result, {**outcome.result.timings, **timings}, notes


def _check_keywords(keywords: Mapping[str, Any], is_paper: bool) -> None:
    """Raise an error if an argument of `segment` is unknown, invalid or an array."""
    defaults = _DEFAULTS[is_paper]
    for name in sorted(keywords.keys() - (defaults.keys() - _ARRAYS)):
        names = f"the options are {', '.join(sorted(defaults.keys() - _ARRAYS))}"
        advice = names if name in defaults else OTHER_NAMES.get(name, names)
        raise TypeError(f"{name} is not an option for files: {advice}")
    for name, kinds in (("weights", (str, Weights)), ("init", str)):
        if not isinstance(keywords.get(name, ""), kinds):
            raise TypeError(f"{name} must not be an array, which would fit only one file")
    if getattr(keywords.get("sizes"), "weights", None) is not None:
        raise TypeError("Sizes.weights must be None, because an array would fit only one file")
    check = paper.checked if is_paper else SegmentOptions.checked
    check(**{**defaults, **keywords})


def _checked_features(given: object, is_paper: bool) -> tuple[str, ...] | Features:
    """Return names of features, or `Features` if their weight is not the default."""
    features = Features.of(() if given is None else given)
    if len(features.names) != len(features.table):
        raise TypeError("features must be names, because an array would fit only one file")
    if features.names and is_paper:
        raise ValueError("paper.segment has no features: leave out features or paper")
    return features.names if features.weight == FEATURE_WEIGHT else features


def _as_json(value: Any) -> Any:
    """Return an option as a JSON value."""
    if isinstance(value, Weights):
        return {"name": value.name, **value.given}
    if isinstance(value, Features):
        return {"table": list(value.table), "weight": value.weight}
    if isinstance(value, Sizes):
        return value.params
    if isinstance(value, np.generic):
        return value.item()
    return list(value) if isinstance(value, tuple) else value


def _are_opaque(attributes: MeshAttributes | None, least: float) -> Bools:
    """Return whether the opacity of each splat is at least `least`; raise MeshError if none is."""
    stored = {} if attributes is None else attributes.vertex
    if "opacity" not in stored:
        raise MeshError("min_opacity needs Gaussian splats, but the file has no property opacity")
    if np.isnan(stored["opacity"]).any():
        first = np.flatnonzero(np.isnan(stored["opacity"]))[0]
        raise MeshError(f"opacity[{first}] is nan: min_opacity needs the opacity of all splats")
    with np.errstate(over="ignore"):  # converts logits to opacities
        is_opaque = 1.0 / (1.0 + np.exp(-stored["opacity"].astype(np.float64))) >= least
    if not is_opaque.any():
        raise MeshError(f"no splat has an opacity >= {least:g}: lower min_opacity")
    return np.asarray(is_opaque)


def _subdivided(source: Cells, options: FileOptions) -> Subdivision:
    """Subdivide a mesh to edges of at most `max_edge`, or of the advised length if it is None."""
    mesh = as_mesh(source)
    get = options.keywords.get
    max_edge = options.max_edge
    if max_edge is None:
        size = CountOptions.checked(get("n_segments"), get("radius"), None)
        max_edge = advised_max_edge(mesh, size)
    return subdivide(mesh, max_edge, n_threads=get("n_threads"))


def _segmented(
    mesh: Cells, of_cells: Mapping[str, Any], options: FileOptions, callback: Callback | None
) -> tuple[Segmentation, tuple[Warning, ...]]:  # fmt: skip
    """Segment a mesh with at most as many regions as cells in the mask, and return the warnings."""
    keywords = dict(options.keywords)
    source: Cells | Prepared = mesh
    if keywords.get("n_segments") is not None:
        n_kept = int(of_cells["mask"].sum()) if "mask" in of_cells else mesh.n_cells
        keywords["n_segments"] = min(keywords["n_segments"], max(n_kept, 1))  # 0 is for `segment`
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)
        function = paper.segment if options.paper else segment
        if options.weld is not True:
            denoise, threads = keywords.get("denoise", "auto"), keywords.get("n_threads")
            source = prepare(mesh, weld=options.weld, denoise=denoise, n_threads=threads)
        result = function(source, callback=callback, **keywords, **of_cells)
    return result, tuple(one.message for one in caught if isinstance(one.message, Warning))
