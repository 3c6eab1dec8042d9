"""Create HTML pages that show a mesh and its regions, for notebooks and files."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy.typing as npt

from superfacets import BorderCut, Segmentation, Texture, cut_borders, kit
from superfacets.kit import MeshLike

from ..camera import Up, View
from ..colors import scale_colors
from ..scene import MOST_CUT, upright
from .coding import Arrays
from .groups import (
    Feature,
    HasLevels,
    Labeling,
    LabelsLike,
    checked_features,
    checked_labeling,
    checked_levels,
)
from .own_colors import color_parts, own_colors
from .shape import STEPS, DrawnSurface, shape_of
from .texture import texture_parts

_MAX_TITLE = 200

# Height of the page in a notebook, in pixels.
_FRAME_HEIGHT = 480


@dataclass(frozen=True)
class Page:
    """HTML page that shows a mesh and its regions; result of ``superfacets.view``.

    A notebook shows the page if it is the last expression in a code cell; ``save(path)`` writes it.

    Attributes
    ----------
    html : str
        Complete page, as self-contained HTML.
    up : {"y", "z", "x"}
        Axis that points up. If the camera has ``up="auto"``, this is the guessed axis.
    """

    html: str
    up: Up

    def __repr__(self) -> str:
        size = f"{len(self.html) / 1e6:.1f} MB"
        return (
            f"Page({size} of HTML: shown by a notebook, or written by .save(path) to a .html file)"
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file whose name ends in .html or .htm; return the path of the file.

        The file is written atomically.

        Raises
        ------
        ValueError
            If the path does not end in .html or .htm.
        OSError
            If the file cannot be written.
        """
        target = checked_page_path(path)
        with kit.atomic_outputs([target]) as (partial,):
            partial.write_text(self.html, encoding="utf-8", newline="\n")
        return target

    def _repr_html_(self) -> str:
        """Return an iframe that shows the page. The page in it cannot access the notebook."""
        return (
            f'<iframe title="superfacets" width="100%" height="{_FRAME_HEIGHT}"'
            ' style="border:0" sandbox="allow-scripts"'
            f' srcdoc="{html.escape(self.html)}"></iframe>'
        )


def view(
    mesh: MeshLike, labels: LabelsLike | None = None, *,
    ground_truth: npt.ArrayLike | None = None, features: Mapping[str, npt.ArrayLike] | None = None,
    texture: Texture | None = None, colors: npt.ArrayLike | None = None, title: str = "superfacets",
    camera: View | None = None, smooth_borders: bool | None = None,
) -> Page:  # fmt: skip
    """Return an HTML page that shows a mesh and its regions, as a single file for offline use.

    On the page, the mesh can be rotated, zoomed and moved. Pointing at a region shows its label,
    its number of cells, and its area or volume. Cells are colored by region, by ground truth or by
    value, and a slider changes the level. Region colors are the same as from `face_colors`, and
    borders are the same as in `plot`. Positions are rounded to 1/65535 of the bounding box, and
    values to 1/65534 of their range. The time and the size of the page are linear in the number of
    cells; the size is about 12 bytes per triangle and at most 4 bytes per color. The browser needs
    WebGL 2.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like
        Same as in `segment`. Polygons are drawn as triangles. Only the outer surface of tetrahedra
        is drawn.
    labels : array_like of integers, shape (N,), (V,) or (L, N), or Hierarchy, optional
        Region of each cell or vertex, any integers; cells with label -1 are gray. For several
        levels, pass a 2D array, a list of arrays, or a `Hierarchy`. The page initially shows the
        first level. If labels are omitted, all cells have the same color.
    ground_truth : array_like of integers, shape (N,), optional
        Ground truth label of each cell. The page can color cells by these labels instead of by
        region.
    features : mapping of str to array_like of numbers, shape (N,), (K,) or (V,), optional
        Named arrays with one value per cell; one value per region of the first level, in ascending
        order of the labels; or one value per vertex of a mesh, averaged over the corners of each
        cell. If N = V, values are values of cells. NaN marks a missing value.
    texture : Texture, optional
        Texture from `read_attributes`. A slider and the key T blend the texture with the colors of
        regions. All images together are scaled down to at most 2048 x 2048 pixels. To read the
        images, install the extra ``texture``.
    colors : array_like, shape (N, 3) or (V, 3), optional
        Red, green and blue of each cell, or of each vertex of a mesh (also if N = V), as floats
        from 0 to 1 or as unsigned integers. `MeshAttributes.colors` are the colors in a mesh file.
        By default, the colors of a `PointCloud` are used, or if `mesh` is a path, the colors in the
        file. Colors are blended like a texture, and ignored if there is a texture. Colors of
        vertices are interpolated in faces, except where each face has its own vertices and color.
        Without labels, ground truth and features, the page initially shows only the texture or the
        colors.
    title : str, default "superfacets"
        Title of the page; only the first 200 characters are used.
    camera : View, optional
        Initial viewpoint. The default is from the right and slightly above.
    smooth_borders : bool, optional
        Same as in `plot`: whether borders of the first level are drawn as smooth curves. The
        default is True if `labels` is a `Segmentation` or `Hierarchy` of at most 500,000 cells. The
        option has no effect on clouds, on tetrahedra, and if there is a texture or colors.

    Returns
    -------
    Page
        Page with ``html``, ``up`` and ``save(path)``. A notebook shows the page.

    Raises
    ------
    MeshError
        If the mesh is not valid, if the texture or the colors do not match the mesh, or if an image
        is missing or damaged.
    MissingExtraError
        If a texture is given but Pillow is not installed.
    ValueError, TypeError
        If another argument is invalid.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> page = view(square, [0, 1], title="a square", features={"height": [0.5, 2]})
    >>> page.html.startswith("<!DOCTYPE html>")
    True
    """
    source: Any = mesh
    attributes = None
    if isinstance(mesh, (str, os.PathLike)):
        source, attributes = kit.CellFile.read(mesh).cells_and_attributes()
    cells = kit.as_cells(source)
    kind, n_cells = kit.kind_of(cells), cells.n_cells
    n_vertices = getattr(cells, "n_vertices", None)
    levels = checked_levels(kit.of_cells(labels, cells), n_cells, n_vertices)
    truth = None if ground_truth is None else checked_labeling(ground_truth, n_cells, n_vertices)
    values = checked_features(features, cells, levels[0].n_regions if levels else None)
    if camera is not None and not isinstance(camera, View):
        raise TypeError(f"camera must be a superfacets.View, got {camera!r}")
    own = own_colors(cells, colors, attributes) if texture is None else None
    shape = shape_of(cells)
    camera = upright(camera or View(), shape.points, shape.triangles)
    if smooth_borders is None:
        smooth_borders = isinstance(labels, (Segmentation, HasLevels)) and n_cells <= MOST_CUT
    is_smooth = kit.checked_flag(smooth_borders, "smooth_borders") and kind.has_faces
    is_plain = texture is None and own is None  # `cut_borders` does not interpolate colors
    is_smooth = is_smooth and is_plain and any(level.n_regions for level in levels[:1])
    cut = cut_borders(cells, levels[0].labels) if is_smooth else None
    arrays = _arrays(shape, cut, levels, truth, values)
    paint, parts = None, {} if own is None else color_parts(cells, shape, own)
    if texture is not None:
        paint, parts = texture_parts(kit.as_mesh(cells), texture)
    for name, (array, coding) in parts.items():
        arrays.add(name, array, coding)
    facts = {
        **_facts_of_shape(shape, camera), "noun": kind.noun,
        "n_cells": n_cells if cut is None else len(cut.sources),
        "measure": "volume" if kind.dimension == 3 else "area",
        "levels": [level.facts(shape) for level in levels],
        "truth": None if truth is None else truth.facts(shape),
        "features": [feature.facts() for feature in values], "texture": paint,
        "arrays": arrays.entries,
    }  # fmt: skip
    size = f"{n_cells:,} {kind.noun}s"
    return Page(_assembled(str(title)[:_MAX_TITLE], size, facts, arrays.text()), camera.up)


def checked_page_path(path: str | os.PathLike[str]) -> Path:
    """Return the path of a page.

    Raises a ValueError if the path does not end in .html or .htm, or an OSError if the file cannot
    be written.
    """
    target = Path(path)
    if target.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"the name of a page must end in .html or .htm, got {target.name!r}")
    kit.checked_targets([target])
    return target


def _arrays(
    shape: DrawnSurface, cut: BorderCut | None, levels: list[Labeling], truth: Labeling | None,
    features: list[Feature],
) -> Arrays:  # fmt: skip
    arrays, drawn = Arrays(), shape
    if cut is not None:
        drawn, finest = shape_of(cut.mesh), levels[0]
        levels = [level.along(cut, finest) for level in levels]
        truth = truth and truth.along(cut, finest)
    labelings = [*levels, *([] if truth is None else [truth])]
    for name, (array, coding) in drawn.parts(drawn.quantized()).items():
        arrays.add(name, array, coding)
    if drawn.outline is not None and labelings:
        edges = drawn.outline.edges([labeling.drawn for labeling in labelings])
        arrays.add("edges", edges, "difference")
    for i, level in enumerate(levels):
        level.add_to(arrays, f"level_{i}", shape, levels[0] if i else None)
    if truth is not None:
        truth.add_to(arrays, "truth", shape, None)
    if features:
        arrays.add("scale", scale_colors().ravel(), "planes")
    for i, feature in enumerate(features):
        steps = feature.steps()
        steps = steps if cut is None or feature.of == "region" else steps[cut.sources]
        arrays.add(f"feature_{i}", steps, "difference")
    return arrays


def _facts_of_shape(shape: DrawnSurface, camera: View) -> dict[str, Any]:
    """Return the initial view, the origin and step of quantized positions, and the point size.

    All lengths are fractions of the diagonal of the bounding box, whose center is the origin.
    """
    low, high = shape.bounds
    return {
        **shape.view_facts(camera),
        "low": ((low - high) / 2 / shape.diagonal).tolist(),
        "step": ((high - low) / shape.diagonal / STEPS).tolist(),
        "point_size": shape.point_size,
    }


def _assembled(title: str, size: str, facts: dict[str, Any], payload: str) -> str:
    """Insert the arguments, the style and the script into the HTML template.

    Text is escaped, so that it cannot close an HTML element.
    """
    folder = files(__package__)
    template, style, script = (
        folder.joinpath(name).read_text(encoding="utf-8")
        for name in ("page.html", "viewer.css", "viewer.js")
    )
    title = title.encode("utf-8", "replace").decode("utf-8")  # a file name may be invalid UTF-8
    parts = {
        "TITLE": html.escape(title), "SIZE": html.escape(size), "PAYLOAD": payload,
        "STYLE": style.strip(), "SCRIPT": script.strip(),
        "FACTS": json.dumps(facts, separators=(",", ":")).replace("<", "\\u003c"),
    }  # fmt: skip
    # The template is split before text is inserted, so that placeholders in the text stay as they
    # are.
    first, *rest = template.split("@")
    pieces = [first]
    for i, piece in enumerate(rest):
        pieces.append(parts[piece] if i % 2 == 0 else piece)
    return "".join(pieces)
