// Bindings of stage 0. The headers of the stage describe the functions; superfacets/_validate.py
// ensures their preconditions.
#include "bindings/bindings.hpp"
#include "mesh/checks.hpp"
#include "mesh/geometry.hpp"
#include "mesh/polygons.hpp"
#include "mesh/subdivision.hpp"
#include "mesh/vertex_graph.hpp"
#include "mesh/weld.hpp"

namespace superfacets {
namespace {

auto bind_check_mesh(const Rows<double>& vertices, const Array<Vertex>& corners, int n_threads) {
  const auto input = std::pair(points(vertices), view(corners));
  const MeshFindings found =
      on_team(vertices.shape(0) + corners.shape(0) / 3, n_threads,
              [&](ThreadTeam& team) { return check_mesh(input.first, input.second, team); });
  return std::tuple(found.is_finite, found.is_in_range, as_tuple(found.low), as_tuple(found.high));
}

template <typename Index>
auto bind_narrow_indices(const Array<Index>& indices, int n_threads) {
  Buffer<std::int32_t> narrow(indices.shape(0));
  const auto input = view(indices);
  on_team(input.size(), n_threads,
          [&](ThreadTeam& team) { narrow_indices(input, team, narrow.span()); });
  return to_numpy(std::move(narrow));
}

auto bind_check_numbers(const Array<double>& numbers, int n_threads) {
  const auto input = view(numbers);
  const NumberFindings found = on_team(
      input.size(), n_threads, [&](ThreadTeam& team) { return check_numbers(input, team); });
  return std::tuple(found.is_valid, found.largest);
}

auto bind_weld_vertices(const Rows<double>& vertices, int n_threads) {
  const auto input = points(vertices);
  return to_numpy(on_team(input.size(), n_threads,
                          [&](ThreadTeam& team) { return weld_vertices(input, team); }));
}

auto bind_build_vertex_graph(const Rows<double>& vertices, const Rows<Vertex>& faces,
                             const Array<Vertex>& representative, int n_threads) {
  const auto input = std::pair(points(vertices), triangles(faces));
  const auto lowest = view(representative);
  VertexGraph graph = on_team(vertices.shape(0), n_threads, [&](ThreadTeam& team) {
    return build_vertex_graph(input.first, input.second, lowest, team);
  });
  return std::tuple(to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
                    to_numpy(std::move(graph.lengths)));
}

auto bind_build_polygon_vertex_graph(const Rows<double>& vertices,
                                     const Array<std::int64_t>& offsets,
                                     const Array<Vertex>& corners,
                                     const Array<Vertex>& representative, int n_threads) {
  const auto input = std::pair(points(vertices), polygons(offsets, corners));
  const auto lowest = view(representative);
  VertexGraph graph = on_team(vertices.shape(0), n_threads, [&](ThreadTeam& team) {
    return build_vertex_graph(input.first, input.second, lowest, team);
  });
  return std::tuple(to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
                    to_numpy(std::move(graph.lengths)));
}

auto bind_measure_polygons(const Rows<double>& vertices, const Array<std::int64_t>& offsets,
                           const Array<Vertex>& corners, int n_threads) {
  const auto input = std::pair(points(vertices), polygons(offsets, corners));
  const auto n_faces = static_cast<std::size_t>(input.second.n_faces());
  Buffer<Point> centroids(n_faces);
  Buffer<double> areas(n_faces);
  Buffer<Point> normals(n_faces);
  on_team(n_faces, n_threads, [&](ThreadTeam& team) {
    measure_polygons(input.first, input.second, team, centroids.span(), areas.span(),
                     normals.span());
  });
  return std::tuple(to_numpy(std::move(centroids)), to_numpy(std::move(areas)),
                    to_numpy(std::move(normals)));
}

double bind_polygon_sliver_area(const Rows<double>& vertices, const Array<std::int64_t>& offsets,
                                const Array<Vertex>& corners, const Array<double>& areas,
                                double min_length, double max_height, int n_threads) {
  const auto input = std::pair(points(vertices), polygons(offsets, corners));
  const auto measures = view(areas);
  return on_team(measures.size(), n_threads, [&](ThreadTeam& team) {
    return polygon_sliver_area(input.first, input.second, measures, min_length, max_height, team);
  });
}

auto bind_triangulate(const Rows<double>& vertices, const Array<std::int64_t>& offsets,
                      const Array<Vertex>& corners, int n_threads) {
  const auto input = std::pair(points(vertices), polygons(offsets, corners));
  const auto n_faces = static_cast<std::size_t>(input.second.n_faces());
  Buffer<Triangle> cut(corners.shape(0) - 2 * n_faces);
  on_team(n_faces, n_threads,
          [&](ThreadTeam& team) { triangulate(input.first, input.second, team, cut.span()); });
  return to_numpy(std::move(cut));
}

auto bind_measure_faces(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  Buffer<Point> centroids(faces.shape(0));
  Buffer<double> areas(faces.shape(0));
  const auto input = std::pair(points(vertices), triangles(faces));
  on_team(faces.shape(0), n_threads, [&](ThreadTeam& team) {
    measure_faces(input.first, input.second, team, {centroids.span(), areas.span(), {}, {}});
  });
  return std::tuple(to_numpy(std::move(centroids)), to_numpy(std::move(areas)));
}

auto bind_measure_shapes(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  Buffer<Point> centroids(faces.shape(0));
  Buffer<double> areas(faces.shape(0));
  Buffer<Point> normals(faces.shape(0));
  Buffer<double> longest((faces.shape(0) + kSumBlock - 1) / kSumBlock);
  const auto input = std::pair(points(vertices), triangles(faces));
  on_team(faces.shape(0), n_threads, [&](ThreadTeam& team) {
    measure_faces(input.first, input.second, team,
                  {centroids.span(), areas.span(), normals.span(), longest.span()});
  });
  return std::tuple(to_numpy(std::move(centroids)), to_numpy(std::move(areas)),
                    to_numpy(std::move(normals)), to_numpy(std::move(longest)));
}

double bind_sliver_area(const Rows<double>& vertices, const Rows<Vertex>& faces,
                        const Array<double>& areas, const Array<double>& longest, double min_length,
                        double max_height, int n_threads) {
  const auto input = std::pair(points(vertices), triangles(faces));
  const auto known = std::pair(view(areas), view(longest));
  return on_team(input.second.size(), n_threads, [&](ThreadTeam& team) {
    return sliver_area(input.first, input.second, known.first, known.second, min_length, max_height,
                       team);
  });
}

auto bind_area_vectors(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  Buffer<Point> vectors(faces.shape(0));
  const auto input = std::pair(points(vertices), triangles(faces));
  on_team(faces.shape(0), n_threads,
          [&](ThreadTeam& team) { area_vectors(input.first, input.second, team, vectors.span()); });
  return to_numpy(std::move(vectors));
}

std::int64_t bind_count_degenerate(const Rows<double>& vertices, const Rows<Vertex>& faces) {
  const auto input = std::pair(points(vertices), triangles(faces));
  return without_gil([&] { return count_degenerate(input.first, input.second); });
}

double bind_signed_volume(const Rows<double>& vertices, const Rows<Vertex>& faces,
                          const std::tuple<double, double, double>& origin, int n_threads) {
  const auto input = std::pair(points(vertices), triangles(faces));
  const Point from = as_point(origin);
  return on_team(faces.shape(0), n_threads, [&](ThreadTeam& team) {
    return signed_volume(input.first, input.second, from, team);
  });
}

auto bind_subdivide(const Rows<double>& vertices, const Rows<Vertex>& faces, double max_edge,
                    std::int64_t max_faces, int n_threads) {
  const auto input = std::pair(points(vertices), triangles(faces));
  constexpr std::int64_t kMinFaces = 256;  // for a thread: a long face may become thousands
  const auto cut = [&](ThreadTeam& team) {
    return subdivide(input.first, input.second, max_edge, max_faces, team);
  };
  Subdivision parts = on_team(input.second.size(), n_threads, cut, kMinFaces);
  return std::tuple(to_numpy(std::move(parts.vertices)), to_numpy(std::move(parts.faces)),
                    to_numpy(std::move(parts.sources)), to_numpy(std::move(parts.depths)));
}

}  // namespace

void bind_mesh(nb::module_& module) {
  module.def("check_mesh", &bind_check_mesh, "vertices"_a.noconvert(), "corners"_a.noconvert(),
             "n_threads"_a);
  module.def("narrow_indices", &bind_narrow_indices<std::int64_t>, "indices"_a.noconvert(),
             "n_threads"_a);
  module.def("narrow_indices", &bind_narrow_indices<std::int32_t>, "indices"_a.noconvert(),
             "n_threads"_a);
  module.def("check_numbers", &bind_check_numbers, "numbers"_a.noconvert(), "n_threads"_a);
  module.def("weld_vertices", &bind_weld_vertices, "vertices"_a.noconvert(), "n_threads"_a);
  module.def("build_vertex_graph", &bind_build_vertex_graph, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "representative"_a.noconvert(), "n_threads"_a);
  module.def("build_polygon_vertex_graph", &bind_build_polygon_vertex_graph,
             "vertices"_a.noconvert(), "offsets"_a.noconvert(), "corners"_a.noconvert(),
             "representative"_a.noconvert(), "n_threads"_a);
  module.def("measure_polygons", &bind_measure_polygons, "vertices"_a.noconvert(),
             "offsets"_a.noconvert(), "corners"_a.noconvert(), "n_threads"_a);
  module.def("polygon_sliver_area", &bind_polygon_sliver_area, "vertices"_a.noconvert(),
             "offsets"_a.noconvert(), "corners"_a.noconvert(), "areas"_a.noconvert(),
             "min_length"_a, "max_height"_a, "n_threads"_a);
  module.def("triangulate", &bind_triangulate, "vertices"_a.noconvert(), "offsets"_a.noconvert(),
             "corners"_a.noconvert(), "n_threads"_a);
  module.def("measure_faces", &bind_measure_faces, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("measure_shapes", &bind_measure_shapes, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "n_threads"_a);
  module.def("sliver_area", &bind_sliver_area, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "areas"_a.noconvert(), "longest"_a.noconvert(), "min_length"_a, "max_height"_a,
             "n_threads"_a);
  module.def("area_vectors", &bind_area_vectors, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("count_degenerate", &bind_count_degenerate, "vertices"_a.noconvert(),
             "faces"_a.noconvert());
  module.def("subdivide", &bind_subdivide, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "max_edge"_a, "max_faces"_a, "n_threads"_a);
  module.def("signed_volume", &bind_signed_volume, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "origin"_a, "n_threads"_a);
}

}  // namespace superfacets
