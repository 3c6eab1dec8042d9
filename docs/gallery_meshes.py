"""Meshes of the examples of the gallery, for pictures and tests."""

import ast
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parent / "examples"


def functions_of(example: str) -> dict[str, Any]:
    """Return the imports and functions of an example, without running the example."""
    path = EXAMPLES / f"{example}.py"
    module = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.Import, ast.ImportFrom, ast.FunctionDef)
    module.body = [node for node in module.body if isinstance(node, kinds)]
    names: dict[str, Any] = {}
    exec(compile(module, path, "exec"), names)
    return names


flange = functions_of("cad_part")["flange"]
scan = functions_of("creases_and_noise")["scan"]
points = functions_of("point_cloud")["points"]
rug = functions_of("colors")["rug"]
knot = functions_of("polygons")["knot"]
body = functions_of("tetrahedra")["body"]
terrain, grid = (functions_of("terrain")[name] for name in ("terrain", "grid"))
room, box, merged = (functions_of("evaluate")[name] for name in ("room", "box", "merged"))
