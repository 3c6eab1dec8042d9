"""Callbacks of sphinx-gallery: the order of the examples, and pictures of plots."""

from typing import Any

from sphinx_gallery.scrapers import figure_rst

from superfacets import Plot

ORDER = [
    "first_segmentation", "creases_and_noise", "cad_part", "point_cloud", "colors", "polygons",
    "tetrahedra", "terrain", "region_graph", "levels", "cut_and_lay_flat", "balance",
    "evaluate", "own_graph",
]  # fmt: skip


def position(filename: str) -> int:
    """Return the position of an example in the gallery."""
    return ORDER.index(filename.removesuffix(".py"))


def save_plot(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the plot at the end of a code block as a picture."""
    names = block_vars["example_globals"]
    plot = names.get("___")
    if not isinstance(plot, Plot) or plot is names.get("_saved"):  # plot of an earlier block
        return ""
    names["_saved"] = plot
    path = plot.save(next(block_vars["image_path_iterator"]))
    return figure_rst([path], gallery_conf["src_dir"])
