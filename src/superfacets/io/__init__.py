"""Reading and writing of meshes and labels, with numpy alone.

- `read_mesh`: a mesh from PLY, OBJ, STL, OFF, glTF or .tri.
- `read_labels`: labels of faces from .npy, .seg, .txt or PLY.
- `write_mesh`: a mesh with labels and colors of its faces, as PLY.
- `write_labels`: labels alone, as .npy, .seg or .txt.
- `write_outputs`, `check_outputs`: several of these at once, and whether that could work.
- `atomic_outputs`: any files, such that all of them appear, or none.

Readers: `ply` (`ply_header`, `ply_body`), `obj`, `stl`, `off`, `tri`, `gltf` (`gltf_file`), all on
`text` and `guards`; `read` picks one. Writers: `ply_write` and `write`, on `atomic`.
"""

from .atomic import atomic_outputs
from .labels import LABEL_ENDINGS, has_labels, read_labels
from .read import MESH_ENDINGS, read_mesh
from .write import check_outputs, write_labels, write_mesh, write_outputs

__all__ = [
    "LABEL_ENDINGS",
    "MESH_ENDINGS",
    "atomic_outputs",
    "check_outputs",
    "has_labels",
    "read_labels",
    "read_mesh",
    "write_labels",
    "write_mesh",
    "write_outputs",
]
