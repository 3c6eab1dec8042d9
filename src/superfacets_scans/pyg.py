"""Write region graphs for PyTorch Geometric, as arrays in an .npz file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import IO

import numpy as np
import numpy.typing as npt

from superfacets import MeshError, RegionGraph
from superfacets.kit import (
    FORMATS,
    Array,
    Ints,
    Longs,
    StrPath,
    atomic_outputs,
    check_length,
    counted,
    known_ending,
    refuse_mask,
)

Graph = Mapping[str, npt.ArrayLike]


def write_graphs(path: StrPath, graphs: Graph | Sequence[Graph]) -> None:
    """Write a region graph, or a sequence of nested region graphs, for PyTorch Geometric.

    Parameters
    ----------
    path : path-like
        Output file; the name must end in ``.npz``. An existing file is replaced when the new file
        is complete, and its permissions are kept.
    graphs : mapping of str to array_like, or a sequence of mappings
        Arrays of a graph, by name. ``edge_index``, (2, E), contains the two regions that each edge
        connects; each edge is listed in both directions. ``edge_attr``, (E, n), has a row per edge.
        ``pos``, (K, 3), and all other arrays except ``super_index`` have a row per region. A
        sequence begins with the finest graph. ``super_index`` of the finest graph is the region of
        each cell. ``super_index`` of any other graph is the region that contains each region of the
        previous graph. A ``super_index`` of -1 means no region.

    Raises
    ------
    ValueError
        If `path` does not end in ``.npz``, if there is no graph, if ``edge_index``, ``pos`` or, for
        nested graphs, ``super_index`` is missing, if an array is not numeric or has a wrong shape,
        if an edge or a ``super_index`` refers to a region that does not exist, or if the sizes of
        nested graphs do not match.
    OSError
        If the file cannot be written.

    Notes
    -----
    Indices are written as int64, and other arrays with their own data type. The arrays of a single
    graph keep their names. Nested graphs are numbered as levels, as in superpoint networks. Level 0
    consists of the cells and has a single array, ``level0_super_index``: the region of level 1 that
    contains each cell. Level 1 is the first graph, with the arrays ``level1_edge_index``,
    ``level1_pos`` and so on. Its ``level1_super_index`` is the region of level 2 that contains each
    region of level 1. The last level has no ``super_index``. Writing does not need torch. After
    loading, the arrays of a level, converted to tensors and without the prefix ``level1_`` in their
    names, can be passed to ``torch_geometric.data.Data(**tensors)``.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> fine = {"edge_index": [[0, 1], [1, 0]], "pos": [[0, 0, 0], [1, 0, 0]],
    ...         "super_index": [0, 0, 1]}
    >>> coarse = {"edge_index": [[], []], "pos": [[0.5, 0, 0]], "super_index": [0, 0]}
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "graph.npz")
    ...     write_graphs(path, [fine, coarse])
    ...     with np.load(path) as file:
    ...         file["level0_super_index"].tolist(), file["level1_super_index"].tolist()
    ([0, 0, 1], [0, 0])
    """
    known_ending(path, FORMATS.graph_outputs)
    arrays = _checked_graphs(graphs)
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        write_arrays(file, arrays)


def write_arrays(file: IO[bytes], arrays: Mapping[str, Array]) -> None:
    """Write checked arrays as an .npz file."""
    np.savez(file, **arrays)  # type: ignore[arg-type]  # mypy: a key could be `allow_pickle`


def write_graph_of(
    file: IO[bytes], graph: RegionGraph, names: Longs, of_vertices: Ints | None
) -> None:
    """Write a graph with the label of each node, and the node of each vertex unless it is None."""
    arrays = graph.to_pyg() | {"region": names.astype(np.int64)}
    if of_vertices is not None:
        arrays["vertex_super_index"] = of_vertices.astype(np.int64)
    write_arrays(file, arrays)


def _checked_graphs(graphs: Graph | Sequence[Graph]) -> dict[str, Array]:
    """Check all graphs, and return their arrays, keyed by array name in the file."""
    if isinstance(graphs, Mapping):
        graph = {name: _checked(values, name) for name, values in graphs.items()}
        _check_graph(graph, "", None)
        return graph
    if not len(graphs):
        raise MeshError("graphs must contain at least one graph")
    n_below: int | None = None
    arrays: dict[str, Array] = {}
    for place, given in enumerate(graphs):
        what = f"graphs[{place}]: "
        graph = {name: _checked(values, what + name) for name, values in given.items()}
        if "super_index" not in graph:
            raise MeshError(f"{what}super_index is missing: nested graphs need it")
        n_below = _check_graph(graph, what, n_below)
        for name, values in graph.items():  # a super_index is stored with the level of its rows
            level = place if name == "super_index" else place + 1
            arrays[f"level{level}_{name}"] = values
    return arrays


def _checked(values: npt.ArrayLike, name: str) -> Array:
    refuse_mask(values, name, MeshError)
    array = np.asarray(values)
    if not array.size and name.endswith("_index"):
        array = array.astype(np.int64)
    if array.dtype.kind not in "biuf":
        raise MeshError(f"{name} must be an array of numbers, got {array.dtype}")
    if not name.endswith("_index"):
        return array
    if array.dtype.kind not in "iu":
        raise MeshError(f"{name} must be integers, got {array.dtype}")
    return array.astype(np.int64)


def _check_graph(graph: Mapping[str, Array], prefix: str, n_below: int | None) -> int:
    """Return the number of regions, or raise a MeshError if arrays are missing or do not match."""
    missing = {"edge_index", "pos"} - graph.keys()
    if missing:
        raise MeshError(f"{prefix}{min(missing)} is missing")
    edges, n_regions = graph["edge_index"], len(graph["pos"])
    if edges.ndim != 2 or len(edges) != 2:
        raise MeshError(f"{prefix}edge_index must have shape (2, E), got {edges.shape}")
    if "edge_attr" in graph and len(graph["edge_attr"]) != edges.shape[1]:
        raise MeshError(
            f"{prefix}edge_attr must have one row per edge ({edges.shape[1]}), got"
            f" {counted(len(graph['edge_attr']), 'row')}"
        )
    members = graph.get("super_index", np.empty(0, np.int64))
    if n_below is not None:
        noun = "region of the previous graph"
        check_length(members, n_below, f"{prefix}super_index", noun, error=MeshError)
    for name, indices, lowest in (("edge_index", edges, 0), ("super_index", members, -1)):
        if indices.size and not lowest <= indices.min() <= indices.max() < n_regions:
            raise MeshError(
                f"{prefix}{name} must be regions from {lowest} to {n_regions - 1}, got"
                f" {indices.min()} to {indices.max()}"
            )
    return n_regions
