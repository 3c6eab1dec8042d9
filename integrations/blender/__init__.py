"""Superfacets in Blender: regions of the active mesh as face sets, an attribute, and seams."""

import warnings

import bpy
import numpy as np

__all__ = ["register", "unregister"]


class SuperfacetsSegment(bpy.types.Operator):
    """Cut the active mesh into compact regions whose borders follow its creases."""

    bl_idname = "object.superfacets_segment"
    bl_label = "Segment into Superfacets"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    n_segments: bpy.props.IntProperty(
        name="Regions", description="Number of regions", default=150, min=1, soft_max=5000
    )
    follow_ridges: bpy.props.FloatProperty(
        name="Follow Ridges",
        description="What rounded ridges count against grooves; sharp ones count 0.35 at least",
        default=0.0,
        min=0.0,
        soft_max=1.0,
    )
    keep_islands: bpy.props.BoolProperty(
        name="Keep Islands",
        description="Give each part that touches no other a region of its own",
        default=True,
    )
    write_face_sets: bpy.props.BoolProperty(name="Face Sets", default=True)
    write_seams: bpy.props.BoolProperty(
        name="Seams", description="Mark the borders of regions as seams", default=False
    )
    attribute: bpy.props.StringProperty(
        name="Attribute",
        description="Face attribute for the numbers of the regions; none if empty",
        default="superfacets",
    )

    @classmethod
    def poll(cls, context):
        """Whether there is a mesh to work on."""
        return context.active_object is not None and context.active_object.type == "MESH"

    def execute(self, context):
        """Segment the active mesh, and say how many regions it has."""
        try:
            from . import faces
        except ModuleNotFoundError as error:
            self.report({"ERROR"}, f"{error}: install superfacets into Blender's Python")
            return {"CANCELLED"}
        mode = context.active_object.mode
        bpy.ops.object.mode_set(mode="OBJECT")  # in others the mesh is not up to date
        try:
            return self._segment(faces, context.active_object)
        except ValueError as error:  # a mesh without polygons, or an attribute of another type
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            bpy.ops.object.mode_set(mode=mode)

    def _segment(self, faces, target):
        mesh = target.data
        starts = _values(mesh.polygons, "loop_start", np.int32)
        polygons = faces.polygons_of(
            _values(mesh.vertices, "co", np.float32, 3),
            starts,
            _values(mesh.loops, "vertex_index", np.int32),
            np.array(target.matrix_world),
        )
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = faces.segment_polygons(
                polygons,
                self.n_segments,
                follow_ridges=self.follow_ridges,
                keep_islands=self.keep_islands,
            )
        if self.write_face_sets:
            _write(mesh, ".sculpt_face_set", faces.face_sets(result.labels))
        if self.attribute:
            _write(mesh, self.attribute, result.labels)
        if self.write_seams:
            edges = _values(mesh.loops, "edge_index", np.int32)
            is_border = faces.border_edges(edges, starts, result.labels, len(mesh.edges))
            mesh.edges.foreach_set("use_seam", is_border)
        mesh.update()
        for warning in caught:
            self.report({"WARNING"}, str(warning.message))
        self.report({"INFO"}, f"{result.n_segments} regions of {polygons.n_faces} polygons")
        return {"FINISHED"}


def _values(items, name, dtype, width=1):
    """One property of all items as an array."""
    values = np.empty(len(items) * width, dtype=dtype)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


def _write(mesh, name, values):
    """Write one integer per polygon; a ValueError if the name is that of something else."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        attribute = mesh.attributes.new(name, "INT", "FACE")
    if attribute.data_type != "INT" or attribute.domain != "FACE":
        raise ValueError(f"the mesh has an attribute {name!r} that is not of integers of faces")
    attribute.data.foreach_set("value", np.ascontiguousarray(values, dtype=np.int32))


def _add_to_menu(menu, context):
    menu.layout.operator(SuperfacetsSegment.bl_idname)


_MENUS = ("VIEW3D_MT_object", "VIEW3D_MT_face_sets")


def register():
    """Add the operator, and entries of the menus Object and Face Sets."""
    bpy.utils.register_class(SuperfacetsSegment)
    for name in _MENUS:
        getattr(bpy.types, name).append(_add_to_menu)


def unregister():
    """Remove what `register` added."""
    for name in _MENUS:
        getattr(bpy.types, name).remove(_add_to_menu)
    bpy.utils.unregister_class(SuperfacetsSegment)
