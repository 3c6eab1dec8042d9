"""Table of file formats: functions that read and write each format, named by strings.

Other packages add formats by entry points of the group ``superfacets.formats``. The name of an
entry point is a role and an ending, for example ``read_faces.abc``; its value is a function:

- ``read_faces``: takes the content of a file, and returns vertices and triangles,
  or vertices, sizes of polygons, and the corners of all polygons;
- ``scenes``: the same for files that refer to other files; also takes their folder (or None);
- ``read_points``: returns a `PointCloud` and the `MeshAttributes` of the points;
- ``read_KIND``, where ``KIND`` is a `Kind.name`, as in ``read_tetrahedra``: returns the cells;
- ``attributes``: takes content and folder; returns vertices and faces, and `MeshAttributes`;
- ``labels``: takes the content and the name of a property; returns the labels of cells. In a table
  ``found_labels`` the result may be None, and in ``vertex_labels`` labels are of vertices;
- ``recognize``: takes the content of a file without a name; returns whether it has this format;
- ``write_KIND``: takes a binary file and an `Output`. ``write_polygons`` also writes triangles.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from typing import Any

from ..base.lazy import Table, added

_READ, _WRITE = "superfacets.files.readers.", "superfacets.files.writers."
_SURFACES = (".white", ".pial", ".inflated", ".smoothwm", ".orig", ".sphere")
_GIFTI_VALUES = (".shape.gii", ".func.gii")
_CURVES = (".curv", ".thickness", ".sulc", ".area")
_TETS = {".mesh": "MEDIT", ".msh": "MSH", ".vtk": "VTK", ".vtu": "VTU"}

_ROLES: dict[str, dict[str, str]] = {
    "scenes": dict.fromkeys((".glb", ".gltf"), f"{_READ}gltf:read_gltf"),
    "read_faces": {
        ".obj": f"{_READ}obj:read_obj",
        ".off": f"{_READ}off:read_off",
        ".ply": f"{_READ}ply:read_ply",
        ".stl": f"{_READ}stl:read_stl",
        ".tri": f"{_READ}off:read_tri",
        ".vtp": "superfacets_formats.vtk_xml:read_vtp",
        ".gii": "superfacets_formats.cortex:read_gifti",
        **dict.fromkeys(_SURFACES, "superfacets_formats.cortex:read_surface"),
    },
    "read_tetrahedra": {
        ending: f"superfacets_formats.tets:{name}.mesh" for ending, name in _TETS.items()
    },
    "read_points": {
        ".ply": f"{_READ}clouds:read_ply_cloud",
        **dict.fromkeys((".xyz", ".txt", ".csv"), f"{_READ}clouds:read_text_cloud"),
        ".npy": f"{_READ}clouds:read_npy_cloud",
        ".las": "superfacets_formats.las:read_las_cloud",
        ".laz": "superfacets_formats.las:read_las_cloud",
        ".pcd": "superfacets_formats.pcd:read_pcd_cloud",
        ".e57": "superfacets_formats.e57:read_e57",
    },
    "attributes": {
        ".ply": f"{_READ}ply:read_ply_with_attributes",
        ".obj": f"{_READ}obj:read_obj_with_attributes",
        ".gii": "superfacets_formats.cortex:read_gifti_with_attributes",
        **dict.fromkeys((".glb", ".gltf"), f"{_READ}gltf:read_gltf_with_attributes"),
    },
    "labels": {
        ".npy": f"{_READ}labels:read_npy_labels",
        ".ply": f"{_READ}ply:read_ply_labels",
        ".seg": f"{_READ}labels:read_text_labels",
        ".txt": f"{_READ}labels:read_text_labels",
        ".stl": f"{_READ}parts:stl_labels",
        ".obj": f"{_READ}parts:obj_labels",
    },
    "found_labels": {
        ".vtp": "superfacets_formats.vtk_xml:vtp_labels",
        **{ending: f"superfacets_formats.tets:{name}.labels" for ending, name in _TETS.items()},
    },
    "vertex_labels": {
        ".segs.json": f"{_READ}labels:read_segments",
        ".label.gii": "superfacets_formats.cortex:gifti_labels",
        ".annot": "superfacets_formats.cortex:annot_labels",
        **dict.fromkeys(_GIFTI_VALUES, "superfacets_formats.cortex:gifti_value_labels"),
        **dict.fromkeys(_CURVES, "superfacets_formats.cortex:curve_value_labels"),
    },
    "recognize": {
        ".vtp": "superfacets_formats.vtk_xml:is_vtp",
        ".gii": "superfacets_formats.cortex:is_gifti",
        _SURFACES[0]: "superfacets_formats.cortex:is_surface",
    },
    "write_polygons": {
        ".ply": f"{_WRITE}ply:write_ply",
        ".vtp": "superfacets_formats.vtk_writer:write_vtp",
        ".obj": f"{_WRITE}obj:write_obj",
        ".off": f"{_WRITE}obj:write_off",
        ".glb": f"{_WRITE}glb:write_glb",
        ".ids.png": "superfacets_textures.ids_image:write_ids",
    },
    "write_triangles": {".stl": f"{_WRITE}stl:write_stl"},
    "write_tetrahedra": {
        ".vtu": "superfacets_formats.vtk_writer:write_vtu",
        ".vtk": "superfacets_formats.vtk_writer:write_vtk",
    },
    "write_points": {
        ".ply": f"{_WRITE}ply:write_cloud_ply",
        ".csv": f"{_WRITE}clouds:write_csv",
        ".pcd": "superfacets_formats.pcd_writer:write_pcd",
        ".las": "superfacets_formats.las_writer:write_las",
        ".laz": "superfacets_formats.las_writer:write_las",
    },
}


def _with_added(roles: Mapping[str, Mapping[str, str]]) -> dict[str, Table]:
    """Return the tables by role, with formats of other packages; these replace no format."""
    tables = {role: Table(endings) for role, endings in roles.items()}
    for name, target in added("superfacets.formats").items():
        role, _, ending = name.partition(".")
        tables.setdefault(role, Table()).setdefault(f".{ending}", target)
    return tables


FORMATS = _with_added(_ROLES)
"""Functions that read or write a format, keyed by role, then by file name ending."""

READERS = {
    role.removeprefix("read_"): table for role, table in FORMATS.items() if role[:5] == "read_"
}
"""Readers of cells, keyed by `Kind.name` (``faces`` for surfaces), then by ending."""

WRITERS: dict[str, Mapping[str, Any]] = {
    role.removeprefix("write_"): table for role, table in FORMATS.items() if role[:6] == "write_"
}
WRITERS["triangles"] = ChainMap(FORMATS["write_triangles"], FORMATS["write_polygons"])
"""Writers of cells, keyed by `Kind.name`, then by ending. The first ending is the default. If a
kind is missing here, only its labels can be written, to label files."""

MESH_ENDINGS = tuple(dict.fromkeys((
    *FORMATS["scenes"],
    *(ending for kind, table in READERS.items() if kind != "points" for ending in table),
)))  # fmt: skip
"""Endings of files with meshes, or with cells of another kind than points."""
CELL_ENDINGS = tuple(dict.fromkeys((*MESH_ENDINGS, *READERS["points"])))
"""Endings of mesh files and of point cloud files."""
