// Bindings of stages 0 to 2. What each function does stands in the header of its stage; what it may
// assume, in superfacets/_validate.py.
#include "bindings/bindings.hpp"
#include "cells/components.hpp"
#include "cells/face_graph.hpp"
#include "cells/weights.hpp"
#include "mesh/checks.hpp"
#include "mesh/geometry.hpp"
#include "mesh/vertex_graph.hpp"
#include "mesh/weld.hpp"
#include "regions/borders.hpp"
#include "regions/smooth.hpp"

namespace superfacets {
namespace {

auto bind_check_mesh(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  const auto input = std::pair(points(vertices), triangles(faces));
  const MeshFindings found =
      on_team(vertices.shape(0) + faces.shape(0), n_threads,
              [&](ThreadTeam& team) { return check_mesh(input.first, input.second, team); });
  return std::tuple(found.is_finite, found.is_in_range, as_tuple(found.low), as_tuple(found.high));
}

auto bind_narrow_indices(const Array<std::int64_t>& indices, int n_threads) {
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

auto bind_build_face_graph(const Rows<Vertex>& faces, const Array<Vertex>& representative,
                           int n_threads) {
  const auto input = triangles(faces);
  const auto vertices = view(representative);
  FaceGraph graph = on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    return build_face_graph(input, vertices, team);
  });
  const EdgeCounts& counts = graph.counts;
  return std::tuple(
      to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
      to_numpy(std::move(graph.sides)), to_numpy(std::move(graph.same_turn)),
      std::tuple(counts.edges, counts.boundary, counts.non_manifold, counts.inconsistent));
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

auto bind_find_components(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                          const Array<Label>& labels) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto input = view(labels);
  Components components = without_gil([&] { return find_components(arcs, input); });
  return std::tuple(to_numpy(std::move(components.of_cell)), components.n_components);
}

auto bind_measure_faces(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  Buffer<Point> centroids(faces.shape(0));
  Buffer<double> areas(faces.shape(0));
  const auto input = std::pair(points(vertices), triangles(faces));
  on_team(faces.shape(0), n_threads, [&](ThreadTeam& team) {
    measure_faces(input.first, input.second, team, centroids.span(), areas.span());
  });
  return std::tuple(to_numpy(std::move(centroids)), to_numpy(std::move(areas)));
}

auto bind_area_vectors(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  Buffer<Point> vectors(faces.shape(0));
  const auto input = std::pair(points(vertices), triangles(faces));
  on_team(faces.shape(0), n_threads,
          [&](ThreadTeam& team) { area_vectors(input.first, input.second, team, vectors.span()); });
  return to_numpy(std::move(vectors));
}

auto bind_superfacet_weights(const Rows<double>& vertices, const Rows<Vertex>& faces,
                             const Rows<double>& centroids, const Array<double>& areas,
                             const Array<std::int64_t>& offsets, const Array<Face>& neighbors,
                             const Array<std::uint16_t>& sides,
                             const Array<std::uint8_t>& same_turn, double alpha, double eta_convex,
                             double crease_length, double diagonal, bool inside_out,
                             int n_threads) {
  Buffer<double> weights(neighbors.shape(0));
  const ArcGeometry arcs{points(vertices), triangles(faces), points(centroids), view(areas),
                         view(offsets),    view(neighbors),  view(sides),       view(same_turn)};
  const WeightOptions options{alpha, eta_convex, crease_length, diagonal, inside_out};
  on_team(faces.shape(0), n_threads,
          [&](ThreadTeam& team) { superfacet_weights(arcs, options, team, weights.span()); });
  return to_numpy(std::move(weights));
}

auto bind_stk02_weights(const Rows<double>& vertices, const Rows<Vertex>& faces,
                        const Rows<double>& centroids, const Array<std::int64_t>& offsets,
                        const Array<Face>& neighbors, const Array<std::uint16_t>& sides,
                        double alpha, int n_threads) {
  Buffer<double> weights(neighbors.shape(0));
  const ArcGeometry arcs{points(vertices), triangles(faces), points(centroids), {},
                         view(offsets),    view(neighbors),  view(sides),       {}};
  on_team(faces.shape(0), n_threads,
          [&](ThreadTeam& team) { stk02_weights(arcs, alpha, team, weights.span()); });
  return to_numpy(std::move(weights));
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

auto bind_quantize_weights(const Array<double>& weights, int n_threads) {
  Buffer<float> lengths(weights.shape(0));
  const auto input = view(weights);
  const double unit = on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    return quantize_weights(input, team, lengths.span());
  });
  return std::tuple(to_numpy(std::move(lengths)), unit);
}

auto bind_smooth_borders(const Rows<double>& vertices, const Rows<Vertex>& faces,
                         const Rows<double>& centroids, const Array<double>& areas,
                         const Array<std::int64_t>& offsets, const Array<Face>& neighbors,
                         const Array<std::uint16_t>& sides, const Array<std::uint8_t>& same_turn,
                         const Array<double>& weights, const Array<Label>& labels,
                         const Array<Face>& fixed, double diagonal, double max_distance,
                         double crease_scale, std::size_t max_chain, int max_sweeps,
                         int n_threads) {
  const ArcGeometry arcs{points(vertices), triangles(faces), points(centroids), view(areas),
                         view(offsets),    view(neighbors),  view(sides),       view(same_turn)};
  const SmoothOptions options{{diagonal, crease_scale}, max_distance, max_chain, max_sweeps};
  const auto lengths = view(weights);
  const auto input = std::pair(view(labels), view(fixed));
  return to_numpy(on_team(faces.shape(0), n_threads, [&](ThreadTeam& team) {
    return smooth_borders(arcs, lengths, input.first, input.second, options, team);
  }));
}

auto bind_region_borders(const Rows<double>& vertices, const Rows<Vertex>& faces,
                         const Rows<double>& centroids, const Array<double>& areas,
                         const Array<std::int64_t>& offsets, const Array<Face>& neighbors,
                         const Array<std::uint16_t>& sides, const Array<std::uint8_t>& same_turn,
                         const Array<double>& weights, const Array<Label>& labels, double diagonal,
                         double crease_scale, int n_threads) {
  const ArcGeometry arcs{points(vertices), triangles(faces), points(centroids), view(areas),
                         view(offsets),    view(neighbors),  view(sides),       view(same_turn)};
  const auto lengths = view(weights);
  const auto regions = view(labels);
  const BorderCost cost{diagonal, crease_scale};
  const std::vector<RegionBorder> borders =
      on_team(faces.shape(0), n_threads,
              [&](ThreadTeam& team) { return region_borders(arcs, lengths, regions, cost, team); });
  std::vector<Label> low;
  std::vector<Label> high;
  std::vector<double> costs;
  for (const RegionBorder& border : borders) {
    low.push_back(border.low);
    high.push_back(border.high);
    costs.push_back(border.cost);
  }
  return std::tuple(to_numpy(std::move(low)), to_numpy(std::move(high)),
                    to_numpy(std::move(costs)));
}

}  // namespace

void bind_mesh_stages(nb::module_& module) {
  module.def("check_mesh", &bind_check_mesh, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("narrow_indices", &bind_narrow_indices, "indices"_a.noconvert(), "n_threads"_a);
  module.def("check_numbers", &bind_check_numbers, "numbers"_a.noconvert(), "n_threads"_a);
  module.def("weld_vertices", &bind_weld_vertices, "vertices"_a.noconvert(), "n_threads"_a);
  module.def("build_face_graph", &bind_build_face_graph, "faces"_a.noconvert(),
             "representative"_a.noconvert(), "n_threads"_a);
  module.def("build_vertex_graph", &bind_build_vertex_graph, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "representative"_a.noconvert(), "n_threads"_a);
  module.def("find_components", &bind_find_components, "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "labels"_a.noconvert());
  module.def("measure_faces", &bind_measure_faces, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("area_vectors", &bind_area_vectors, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("superfacet_weights", &bind_superfacet_weights, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "centroids"_a.noconvert(), "areas"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "sides"_a.noconvert(),
             "same_turn"_a.noconvert(), "alpha"_a, "eta_convex"_a, "crease_length"_a, "diagonal"_a,
             "inside_out"_a, "n_threads"_a);
  module.def("stk02_weights", &bind_stk02_weights, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "centroids"_a.noconvert(), "offsets"_a.noconvert(), "neighbors"_a.noconvert(),
             "sides"_a.noconvert(), "alpha"_a, "n_threads"_a);
  module.def("count_degenerate", &bind_count_degenerate, "vertices"_a.noconvert(),
             "faces"_a.noconvert());
  module.def("signed_volume", &bind_signed_volume, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "origin"_a, "n_threads"_a);
  module.def("smooth_borders", &bind_smooth_borders, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "centroids"_a.noconvert(), "areas"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "sides"_a.noconvert(),
             "same_turn"_a.noconvert(), "weights"_a.noconvert(), "labels"_a.noconvert(),
             "fixed"_a.noconvert(), "diagonal"_a, "max_distance"_a, "crease_scale"_a, "max_chain"_a,
             "max_sweeps"_a, "n_threads"_a);
  module.def("region_borders", &bind_region_borders, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "centroids"_a.noconvert(), "areas"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "sides"_a.noconvert(),
             "same_turn"_a.noconvert(), "weights"_a.noconvert(), "labels"_a.noconvert(),
             "diagonal"_a, "crease_scale"_a, "n_threads"_a);
  module.def("quantize_weights", &bind_quantize_weights, "weights"_a.noconvert(), "n_threads"_a);
}

}  // namespace superfacets
