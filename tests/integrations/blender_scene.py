"""Run the extension in Blender's module `bpy`, and print one line of JSON per case.

This is a separate process, because importing bpy changes much of its process.
"""

import importlib.util
import json
import sys
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(__file__).resolve().parents[2] / "integrations/blender"


def main():
    spec = importlib.util.spec_from_file_location(
        "superfacets_extension", FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
    )
    extension = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = extension
    spec.loader.exec_module(extension)
    extension.register()
    say("monkey", monkey())
    say("modes", modes())
    say("refused", refused())
    extension.unregister()
    say("gone", not hasattr(bpy.types, "OBJECT_OT_superfacets_segment"))


def say(case, value):
    print(json.dumps({"case": case, "value": value}))


def values(mesh, name):
    data = mesh.attributes[name].data
    found = np.empty(len(data), np.int32)
    data.foreach_get("value", found)
    return found


def monkey():
    """Segment Suzanne, the monkey of Blender, which has quads and triangles in three components."""
    bpy.ops.mesh.primitive_monkey_add()
    target = bpy.context.active_object
    target.scale = (1, 2, 1)
    bpy.context.view_layer.update()
    status = bpy.ops.object.superfacets_segment(n_segments=20, write_seams=True)
    mesh = target.data
    labels, sets = values(mesh, "superfacets"), values(mesh, ".sculpt_face_set")
    seams = np.empty(len(mesh.edges), bool)
    mesh.edges.foreach_get("use_seam", seams)
    n_loops, corners = len(mesh.loops), np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return {
        "status": sorted(status), "labels": labels.tolist(), "sets": sets.tolist(),
        "positions": positions.tolist(), "offsets": [*starts.tolist(), n_loops],
        "corners": corners.tolist(), "n_seams": int(seams.sum()),
    }  # fmt: skip


def modes():
    """Return the mode of the object after each call."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    found = []
    for mode in ("EDIT", "SCULPT", "OBJECT"):
        bpy.ops.object.mode_set(mode=mode)
        bpy.ops.object.superfacets_segment(n_segments=10, attribute="")
        found.append(bpy.context.active_object.mode)
    names = [attribute.name for attribute in bpy.context.active_object.data.attributes]
    return {"modes": found, "has_attribute": "superfacets" in names}


def refused():
    """Return the messages for an attribute of another type, and for a mesh without polygons."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.active_object.data.attributes.new("superfacets", "FLOAT", "POINT")
    messages = [message_of(bpy.ops.object.superfacets_segment)]
    empty = bpy.data.objects.new("empty", bpy.data.meshes.new("empty"))
    bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = empty
    return [*messages, message_of(bpy.ops.object.superfacets_segment)]


def message_of(operator):
    """Return the error message of an operator, which scripts get as an exception."""
    try:
        operator()
    except RuntimeError as error:
        return str(error)
    return ""


if __name__ == "__main__":
    main()
