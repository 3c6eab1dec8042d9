"""Write the borders of regions as polylines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from superfacets import BorderLines, kit

LINE_ENDINGS = (".obj", ".vtp")


def write_borders(
    path: Path, write_vtk: Callable[..., object], vertices: kit.Floats, lines: BorderLines,
    names: kit.Ints,
) -> None:  # fmt: skip
    """Write border lines as OBJ or VTP, with the vertices on the lines; regions get new `names`.

    In OBJ, each line is a group ``border_3_7``, or ``border_3_open`` at the boundary of the mesh.
    In VTP, the numbers of the two regions are the cell data ``low`` and ``high``; `write_vtk` is
    `superfacets_formats.write_vtk_xml`, which this package does not import.
    """
    rows = lines.paths
    used, along = np.unique(np.concatenate([np.empty(0, int), *rows]), return_inverse=True)
    ends = np.cumsum([*map(len, rows)], dtype=np.int64)
    low, high = np.append(names, -1)[lines.regions].astype(np.int32).T  # -1 at the boundary
    ending = kit.known_ending(path, LINE_ENDINGS)
    with kit.atomic_outputs([path]) as temporaries, temporaries[0].open("wb") as file:
        if ending == ".vtp":
            sections: dict[str, dict[str, kit.Array]] = {
                "CellData": {"low": low, "high": high},
                "Points": {"Points": vertices[used]},
                "Lines": {"connectivity": along.astype(np.int64), "offsets": ends},
            }
            counts = {"NumberOfPoints": len(used), "NumberOfLines": len(rows)}
            write_vtk(file, "PolyData", counts, sections, ascii=False)
            return
        points = vertices[used].tolist()
        file.writelines(f"v {x!r} {y!r} {z!r}\n".encode() for x, y, z in points)
        parts = np.split(along + 1, ends[:-1])
        for first, second, part in zip(low.tolist(), high.tolist(), parts, strict=False):
            row = " ".join(map(str, part.tolist()))
            other = "open" if second < 0 else second
            file.write(f"g border_{first}_{other}\nl {row}\n".encode())
