// Bindings of stage 0. The functions are documented in the headers of mesh/. Their preconditions
// are checked by superfacets/base/checks.py.
#include "bindings/bindings.hpp"
#include "mesh/checks.hpp"
#include "mesh/geometry.hpp"
#include "mesh/polygons.hpp"
#include "mesh/roughness.hpp"
#include "mesh/subdivision.hpp"
#include "mesh/vertex_graph.hpp"
#include "mesh/weld.hpp"

namespace superfacets {
namespace {

VertexGraph vertex_graph(Points vertices, Integers corners, Offsets offsets, std::int64_t size,
                         Integers representative, ThreadTeam& team) {
  return build_vertex_graph(vertices, {corners, offsets, size}, representative, team);
}

Buffer<Point> smooth(Points vertices, Integers corners, Offsets offsets, std::int64_t size,
                     Integers representative, Offsets arcs, int n_steps, ThreadTeam& team) {
  return smooth_positions(vertices, {corners, offsets, size}, representative, arcs, n_steps, team);
}

Buffer<Point> normals_of_vertices(Points vertices, Integers corners, Offsets offsets,
                                  std::int64_t size, Integers representative) {
  return mean_normals(vertices, {corners, offsets, size}, representative);
}

Roughness roughness_of_faces(Points vertices, Integers corners, Offsets corner_offsets,
                             std::int64_t size, Offsets offsets, Integers neighbors, Integers faces,
                             ThreadTeam& team) {
  return measure_roughness(vertices, {corners, corner_offsets, size}, offsets, neighbors, faces,
                           team);
}

PolygonShapes shapes_of_polygons(Points vertices, Offsets offsets, Integers corners,
                                 ThreadTeam& team) {
  return measure_polygons(vertices, {offsets, corners}, team);
}

double sliver_area_of_polygons(Points vertices, Offsets offsets, Integers corners, Doubles areas,
                               double min_length, double max_height, ThreadTeam& team) {
  return polygon_sliver_area(vertices, {offsets, corners}, areas, min_length, max_height, team);
}

Buffer<Triangle> triangles_of(Points vertices, Offsets offsets, Integers corners,
                              ThreadTeam& team) {
  return triangulate(vertices, {offsets, corners}, team);
}

// Minimum number of faces per thread. The number is small, because one large face may be cut into
// thousands of parts.
constexpr std::int64_t kMinSubdivided = 256;

}  // namespace

void bind_mesh(nb::module_& module) {
  module.def("check_mesh", threaded(&check_mesh), "vertices"_a, "corners"_a, "n_threads"_a);
  module.def("narrow_indices", threaded(&narrow_indices<std::int64_t>), "indices"_a, "n_threads"_a);
  module.def("narrow_indices", threaded(&narrow_indices<std::int32_t>), "indices"_a, "n_threads"_a);
  module.def("check_numbers", threaded(&check_numbers), "numbers"_a, "n_threads"_a);
  module.def("weld_vertices", threaded(&weld_vertices), "vertices"_a, "n_threads"_a);
  module.def("build_vertex_graph", threaded(&vertex_graph), "vertices"_a, "corners"_a, "offsets"_a,
             "size"_a, "representative"_a, "n_threads"_a);
  module.def("smooth_positions", threaded(&smooth), "vertices"_a, "corners"_a, "offsets"_a,
             "size"_a, "representative"_a, "arcs"_a, "n_steps"_a, "n_threads"_a);
  module.def("mean_normals", serial(&normals_of_vertices), "vertices"_a, "corners"_a, "offsets"_a,
             "size"_a, "representative"_a);
  module.def("measure_roughness", threaded(&roughness_of_faces), "vertices"_a, "corners"_a,
             "corner_offsets"_a, "size"_a, "offsets"_a, "neighbors"_a, "faces"_a, "n_threads"_a);
  module.def("measure_polygons", threaded(&shapes_of_polygons), "vertices"_a, "offsets"_a,
             "corners"_a, "n_threads"_a);
  module.def("polygon_sliver_area", threaded(&sliver_area_of_polygons), "vertices"_a, "offsets"_a,
             "corners"_a, "areas"_a, "min_length"_a, "max_height"_a, "n_threads"_a);
  module.def("triangulate", threaded(&triangles_of), "vertices"_a, "offsets"_a, "corners"_a,
             "n_threads"_a);
  module.def("measure_faces", threaded(&measure_faces), "vertices"_a, "faces"_a, "n_threads"_a);
  module.def("unit_normals", threaded(&unit_normals), "vertices"_a, "faces"_a, "n_threads"_a);
  module.def("single_normals", threaded(&single_normals), "vertices"_a, "faces"_a, "n_threads"_a);
  module.def("sliver_area", threaded(&sliver_area), "vertices"_a, "faces"_a, "areas"_a, "longest"_a,
             "min_length"_a, "max_height"_a, "n_threads"_a);
  module.def("area_vectors", threaded(&area_vectors), "vertices"_a, "faces"_a, "n_threads"_a);
  module.def("count_degenerate", serial(&count_degenerate), "vertices"_a, "faces"_a);
  module.def("subdivide", threaded<kMinSubdivided>(&subdivide), "vertices"_a, "faces"_a,
             "max_edge"_a, "max_faces"_a, "n_threads"_a);
  module.def("weighted_mean", threaded(&weighted_mean), "positions"_a, "weights"_a, "n_threads"_a);
  module.def("signed_volume", threaded(&signed_volume), "vertices"_a, "faces"_a, "origin"_a,
             "n_threads"_a);
}

}  // namespace superfacets
