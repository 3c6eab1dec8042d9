"""Table of file formats: functions that read and write each format, named by strings.

Other packages add formats by entry points of the group ``superfacets.formats``. The name of an
entry point is a role and an ending, for example ``read.abc``; its value is a function:

- ``read``: takes an `Input`, and returns the result of `Input.mesh`, `Input.of_cells` or
  `Input.cloud`: cells and attributes of a mesh file, or of its points if it has no cells;
- ``read_points``: the same for formats that contain only points;
- ``labels``: takes the content of a label file, and returns labels of cells; ``vertex_labels``
  returns labels of vertices; ``groups`` does the same from an `Input`; ``vertex_lists`` returns the
  vertices with label 0, and all others get -1. In other formats, labels are attributes of the cells
  or vertices;
- ``steps``: takes the content, and returns the quantization steps of x, y and z;
- ``recognize``: takes the content of a file without a name; returns whether it has this format;
- ``write_KIND``: takes a binary file and an `Output`. ``write_polygons`` also writes triangles.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from itertools import chain
from pathlib import PurePath
from typing import Any

from ..base.errors import MissingExtraError
from ..base.lazy import Table

_READ, _WRITE = "superfacets.files.readers.", "superfacets.files.writers."
_EXTRAS = {
    ".las": ("laspy", "las"), ".laz": ("lazrs", "las"), ".pcd": ("pypcd4", "pcd"),
    ".e57": ("pye57", "e57"), ".vtk": ("vtkmodules", "viz"),
    ".msh": ("meshio", "mesh"), ".mesh": ("meshio", "mesh"),
}  # fmt: skip
"""Package that reads a format, and the extra of superfacets that installs it, by ending."""

_WRITE_EXTRAS = {".pth": ("torch", "torch"), ".las": _EXTRAS[".las"], ".laz": _EXTRAS[".laz"]}
"""Same as `_EXTRAS`, for writing."""

_SURFACES = (".white", ".pial", ".inflated", ".smoothwm", ".orig", ".sphere")
_GIFTI_VALUES = (".shape.gii", ".func.gii")
_CURVES = (".curv", ".thickness", ".sulc", ".area")

_ROLES: dict[str, dict[str, str]] = {
    "read": {
        **{f".{name}": f"{_READ}{name}:read_{name}" for name in ("ply", "obj", "stl", "off")},
        **dict.fromkeys((".glb", ".gltf"), f"{_READ}gltf:read_gltf"),
        ".vtp": "superfacets_formats.vtk_xml:read_vtp",
        ".vtu": "superfacets_formats.vtk_xml:read_vtu",
        ".vtk": "superfacets_formats.grids:read_vtk",
        **dict.fromkeys((".msh", ".mesh"), "superfacets_formats.grids:read_with_meshio"),
        ".gii": "superfacets_formats.cortex:read_gifti",
        **dict.fromkeys(_SURFACES, "superfacets_formats.cortex:read_surface"),
    },
    "read_points": {
        **dict.fromkeys((".xyz", ".txt", ".csv"), f"{_READ}clouds:read_text_cloud"),
        ".npy": f"{_READ}clouds:read_npy_cloud",
        **dict.fromkeys((".las", ".laz"), "superfacets_formats.las:read_las"),
        ".pcd": "superfacets_formats.pcd:read_pcd", ".e57": "superfacets_formats.e57:read_e57",
    },
    "labels": {
        ".npy": f"{_READ}npy:npy_array",
        **dict.fromkeys((".seg", ".txt"), f"{_READ}labels:read_text_labels"),
    },
    "vertex_labels": {
        ".segs.json": "superfacets_scans.scannet:read_segments",
        ".label.gii": "superfacets_formats.cortex:gifti_labels",
        ".annot": "superfacets_formats.cortex:annot_labels",
        **dict.fromkeys(_GIFTI_VALUES, "superfacets_formats.cortex:gifti_values"),
        **dict.fromkeys(_CURVES, "superfacets_formats.cortex:curve_values"),
    },
    "vertex_lists": {".label": "superfacets_formats.cortex:listed_vertices"},
    "groups": {".aggregation.json": "superfacets_scans.aggregation:objects_of_vertices"},
    "steps": dict.fromkeys((".las", ".laz"), "superfacets_formats.las:las_steps"),
    "recognize": {
        ".vtp": "superfacets_formats.vtk_xml:is_vtp", ".gii": "superfacets_formats.cortex:is_gifti",
        _SURFACES[0]: "superfacets_formats.cortex:is_surface",
        ".stl": f"{_READ}stl:has_binary_size",
    },
    "write_polygons": {
        ".ply": f"{_WRITE}ply:write_ply", ".vtp": "superfacets_formats.vtk_writer:write_vtp",
        ".obj": f"{_WRITE}text_formats:write_obj", ".off": f"{_WRITE}text_formats:write_off",
        ".glb": "superfacets_textures.glb:write_glb",
        ".ids.png": "superfacets_textures.ids_image:write_ids",
    },
    "write_triangles": {".stl": f"{_WRITE}text_formats:write_stl"},
    "write_tetrahedra": {
        ".vtu": "superfacets_formats.vtk_writer:write_vtu",
        ".vtk": "superfacets_formats.vtk_writer:write_vtk",
    },
    "write_points": {
        ".ply": f"{_WRITE}ply:write_cloud_ply", ".csv": f"{_WRITE}text_formats:write_csv",
        ".pcd": "superfacets_formats.pcd:write_pcd",
        **dict.fromkeys((".las", ".laz"), "superfacets_formats.las_writer:write_las"),
    },
}  # fmt: skip


class Formats(dict[str, Table]):
    """Functions that read or write a format, keyed by role, then by file name ending.

    Attributes list file name endings, in lower case. Apps use them to offer formats, check formats,
    and know what a format stores. Formats of other packages are included, but replace none.
    """

    def __init__(self, roles: Mapping[str, Mapping[str, str]]) -> None:
        super().__init__({role: Table(endings) for role, endings in roles.items()})
        for name, target in Table.added("superfacets.formats").items():
            role, _, ending = name.partition(".")
            self.setdefault(role, Table()).setdefault(f".{ending}", target)
        self._list_inputs()
        self._list_outputs()

    def _list_inputs(self) -> None:
        self.meshes = _distinct(self["read"])
        """Files with meshes, or with cells of another kind than points."""
        self.cells = _distinct(self.meshes, self["read_points"])
        """Mesh files and point cloud files."""
        self.extras = {ending: extra for ending, (_, extra) in _EXTRAS.items()}
        """Extra of superfacets that reading needs, by ending."""
        self.z_up = (".las", ".laz", ".e57", ".gii", *_SURFACES)
        """Files in which z points up. glTF defines y, but many files do not follow this."""
        of_vertices = (self[role] for role in ("vertex_labels", "vertex_lists", "groups"))
        self.labels = _distinct(self["labels"], self.cells, *of_vertices)
        """Files with labels."""
        self.vertex_values = (*_GIFTI_VALUES, *_CURVES)
        """Files with a number per vertex. Whole numbers may be labels."""
        self.value_files = (".npy", ".txt", *self.vertex_values)
        """Files with a number per cell, region or vertex."""
        self.key_labels = (".label.gii", ".annot")
        """Files with one label per vertex, which may be -1, and a table of colors and names. The
        label is the key of the vertex, or its row in the table, minus 1."""
        self.area_files = (*self.key_labels, *self["vertex_lists"])
        """Files with one label per vertex, where -1 means no area."""

    def _list_outputs(self) -> None:
        self.writers: dict[str, Mapping[str, Any]] = {
            key.removeprefix("write_"): table for key, table in self.items() if key[:6] == "write_"
        }
        """Writers of cells, keyed by `Kind.name`, then by ending. The first ending is the default.
        If a kind is missing here, only its labels can be written, to label files."""
        faces = self["write_polygons"]
        self.writers["triangles"] = ChainMap(self["write_triangles"], faces)
        kinds = [table for kind, table in self.writers.items() if kind != "points"]
        self.cell_outputs = _distinct(self.writers["triangles"], *kinds, self.writers["points"])
        """Files that store the cells. All others store only labels, or data derived from them."""
        self.attribute_outputs = (
            *self.writers["triangles"], *self["write_tetrahedra"],
            ".csv", ".pcd", ".las", ".laz", ".label.gii",
        )  # fmt: skip
        """Files for which commands read the attributes of the input, including its texture."""
        self.class_outputs = (".glb", ".obj", ".stl", ".aggregation.json", *self.key_labels)
        """Files that store a class per region."""
        self.sorted_outputs = (".obj", ".stl")
        """Files whose faces are sorted by region."""
        volumes = dict.fromkeys((".vtu", ".vtk", ".msh", ".mesh"), ".vtu")
        self.usual_outputs = volumes | {".las": ".las", ".laz": ".laz"}
        """Default ending of results, keyed by the ending of the input; .ply for other inputs."""
        self.label_outputs = (".npy", ".seg", ".txt")
        """Files with one label per cell."""
        self.graph_outputs = (".npz",)
        """Files with the graph of the regions."""
        self.renumbered_outputs = (".bin", "_sp_label.npy", ".pth")
        """Files whose ids are renumbered from 0, without gaps."""
        self.vertex_outputs = (".segs.json", *self.renumbered_outputs)
        """Files with one id per vertex, 0 or greater."""
        ids = (*self.vertex_outputs, *self.key_labels)
        self.unconverted_outputs = (*ids, ".aggregation.json", *self.graph_outputs)
        """Files that store given labels of vertices unchanged. Other label files store labels of
        cells, even if labels of vertices are given."""
        self.id_outputs = (*ids, ".sstk.json", ".aggregation.json")
        """Label files that `write_mesh` derives from a mesh and its labels."""
        listed = (self.label_outputs, self.id_outputs, self.graph_outputs)
        self.outputs = (*self.cell_outputs, *chain.from_iterable(listed))
        """All output files."""
        self.ending_of = {ending.lstrip("._"): ending for ending in self.outputs}
        """Maps names of output formats, such as ``ply`` or ``sp_label.npy``, to endings."""

    @staticmethod
    def check_readers(
        endings: Iterable[str], packages: Mapping[str, tuple[str, str]] = _EXTRAS
    ) -> None:
        """Raise a MissingExtraError if the package that reads one of these formats is missing."""
        for ending in endings:
            if ending in packages and find_spec(packages[ending][0]) is None:
                raise MissingExtraError(f"a {ending} file", packages[ending][1])

    def check_writers(self, endings: Iterable[str]) -> None:
        """Raise a MissingExtraError if the package that writes one of these formats is missing."""
        self.check_readers(endings, _WRITE_EXTRAS)

    @staticmethod
    def stem_of(path: PurePath) -> str:
        """Return a file name without its ending; endings that name the content (``.pial``) stay."""
        return path.name if path.suffix.lower() in (*_SURFACES, *_CURVES) else path.stem

    def usual_output(self, kind: str) -> str:
        """Return the default ending of files with cells of the kind named `kind`."""
        return next(iter(self.writers.get(kind, self["write_polygons"])))


def _distinct(*endings: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(chain.from_iterable(endings)))


FORMATS = Formats(_ROLES)
"""The table of file formats."""
