// The Python module superfacets._core: typed arrays in, arrays out, no logic. What each function
// does stands in the header of its stage; what it may assume, in superfacets/_validate.py.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <tuple>
#include <utility>

#include "classify.hpp"
#include "face_graph.hpp"
#include "seeding.hpp"
#include "update.hpp"
#include "weights.hpp"
#include "weld.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace superfacets {
namespace {

template <typename T>
using Array = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Rows = nb::ndarray<const T, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
template <typename T>
using NewArray = nb::ndarray<nb::numpy, T, nb::ndim<1>, nb::c_contig>;
using NewRows = nb::ndarray<nb::numpy, double, nb::shape<-1, 3>, nb::c_contig>;

template <typename T>
std::span<const T> view(const Array<T>& array) {
  return {array.data(), array.shape(0)};
}

std::span<const Point> points(const Rows<double>& rows) {
  return {reinterpret_cast<const Point*>(rows.data()), rows.shape(0)};
}

std::span<const Triangle> triangles(const Rows<Vertex>& rows) {
  return {reinterpret_cast<const Triangle*>(rows.data()), rows.shape(0)};
}

// Moves a vector to the heap and returns it with the capsule that will delete it.
template <typename T>
std::pair<std::vector<T>*, nb::capsule> own(std::vector<T>&& values) {
  values.reserve(1);  // numpy wants a valid pointer for an empty array too
  auto* owned = new std::vector<T>(std::move(values));
  return {owned,
          nb::capsule(owned, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); })};
}

template <typename T>
NewArray<T> to_numpy(std::vector<T>&& values) {
  auto [owned, owner] = own(std::move(values));
  return NewArray<T>(owned->data(), {owned->size()}, owner);
}

NewRows to_numpy(std::vector<Point>&& values) {
  auto [owned, owner] = own(std::move(values));
  return NewRows(reinterpret_cast<double*>(owned->data()), {owned->size(), 3}, owner);
}

Point as_point(const std::tuple<double, double, double>& xyz) {
  return {std::get<0>(xyz), std::get<1>(xyz), std::get<2>(xyz)};
}

CellGraph cell_graph(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                     const Array<Cell>& neighbors, const Array<float>& lengths) {
  return {points(positions), view(offsets), view(neighbors), view(lengths)};
}

// Calls a kernel with the GIL released; arguments are bound before and results wrapped after.
template <typename Kernel>
auto without_gil(const Kernel& kernel) {
  const nb::gil_scoped_release release;
  return kernel();
}

auto bind_weld_vertices(const Rows<double>& vertices) {
  const auto input = points(vertices);
  return to_numpy(without_gil([&] { return weld_vertices(input); }));
}

auto bind_build_face_graph(const Rows<Vertex>& faces, const Array<Vertex>& representative) {
  const auto input = triangles(faces);
  const auto vertices = view(representative);
  FaceGraph graph = without_gil([&] { return build_face_graph(input, vertices); });
  const EdgeCounts& counts = graph.counts;
  return std::tuple(
      to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
      to_numpy(std::move(graph.sides)), to_numpy(std::move(graph.same_turn)),
      std::tuple(counts.edges, counts.boundary, counts.non_manifold, counts.inconsistent));
}

auto bind_measure_faces(const Rows<double>& vertices, const Rows<Vertex>& faces, int n_threads) {
  std::vector<Point> centroids(faces.shape(0));
  std::vector<double> areas(faces.shape(0));
  const auto input = std::pair(points(vertices), triangles(faces));
  without_gil([&] { measure_faces(input.first, input.second, n_threads, centroids, areas); });
  return std::tuple(to_numpy(std::move(centroids)), to_numpy(std::move(areas)));
}

auto bind_superfacet_weights(const Rows<double>& vertices, const Rows<Vertex>& faces,
                             const Rows<double>& centroids, const Array<double>& areas,
                             const Array<std::int64_t>& offsets, const Array<Face>& neighbors,
                             const Array<std::uint16_t>& sides,
                             const Array<std::uint8_t>& same_turn, double alpha, double eta_convex,
                             double diagonal, bool inside_out, int n_threads) {
  std::vector<double> weights(neighbors.shape(0));
  const ArcGeometry arcs{points(vertices), triangles(faces), points(centroids), view(areas),
                         view(offsets),    view(neighbors),  view(sides),       view(same_turn)};
  const WeightOptions options{alpha, eta_convex, diagonal, inside_out};
  without_gil([&] { superfacet_weights(arcs, options, n_threads, weights); });
  return to_numpy(std::move(weights));
}

std::int64_t bind_count_degenerate(const Rows<double>& vertices, const Rows<Vertex>& faces) {
  const auto input = std::pair(points(vertices), triangles(faces));
  return without_gil([&] { return count_degenerate(input.first, input.second); });
}

double bind_signed_volume(const Rows<double>& vertices, const Rows<Vertex>& faces,
                          const std::tuple<double, double, double>& origin) {
  const auto input = std::pair(points(vertices), triangles(faces));
  const Point from = as_point(origin);
  return without_gil([&] { return signed_volume(input.first, input.second, from); });
}

auto bind_quantize_weights(const Array<double>& weights) {
  std::vector<float> lengths(weights.shape(0));
  const auto input = view(weights);
  const double unit = without_gil([&] { return quantize_weights(input, lengths); });
  return std::tuple(to_numpy(std::move(lengths)), unit);
}

auto bind_weighted_mean(const Rows<double>& positions, const Array<double>& measures) {
  const auto input = std::pair(points(positions), view(measures));
  const Point mean = without_gil([&] { return weighted_mean(input.first, input.second); });
  return std::tuple(mean.x, mean.y, mean.z);
}

Cell bind_nearest_cell(const Rows<double>& positions,
                       const std::tuple<double, double, double>& target) {
  const auto input = points(positions);
  const Point to = as_point(target);
  return without_gil([&] { return nearest_cell(input, to); });
}

auto bind_farthest_seeds(const Rows<double>& positions, Cell first, Cell n_seeds) {
  const auto input = points(positions);
  return to_numpy(without_gil([&] { return farthest_seeds(input, first, n_seeds); }));
}

auto bind_flood_seeds(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                      const Array<Cell>& neighbors, const Array<float>& lengths, Cell first,
                      double reach) {
  const CellGraph graph = cell_graph(positions, offsets, neighbors, lengths);
  return to_numpy(without_gil([&] { return flood_seeds(graph, first, reach); }));
}

auto bind_grid_labels(const Rows<double>& positions,
                      const std::tuple<double, double, double>& corner, double side) {
  const auto input = points(positions);
  const Point low = as_point(corner);
  return to_numpy(without_gil([&] { return grid_labels(input, low, side); }));
}

auto wrap(Classification&& result) {
  return std::tuple(to_numpy(std::move(result.labels)), to_numpy(std::move(result.lengths)),
                    to_numpy(std::move(result.centers)));
}

auto bind_classify_exact(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                         const Array<Cell>& neighbors, const Array<float>& lengths,
                         const Array<Cell>& centers) {
  const CellGraph graph = cell_graph(positions, offsets, neighbors, lengths);
  const auto input = view(centers);
  return wrap(without_gil([&] { return classify_exact(graph, input); }));
}

auto bind_reclassify_exact(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                           const Array<Cell>& neighbors, const Array<float>& lengths,
                           const Array<Cell>& centers, const Array<Label>& previous_labels,
                           const Array<PathLength>& previous_lengths,
                           const Array<Cell>& previous_centers) {
  const CellGraph graph = cell_graph(positions, offsets, neighbors, lengths);
  const ClassificationView previous{view(previous_labels), view(previous_lengths),
                                    view(previous_centers)};
  const auto input = view(centers);
  return wrap(without_gil([&] { return reclassify_exact(graph, input, previous); }));
}

auto bind_classify_halted(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                          const Array<Cell>& neighbors, const Array<float>& lengths,
                          const Array<Cell>& centers, double reach, int n_threads) {
  const CellGraph graph = cell_graph(positions, offsets, neighbors, lengths);
  const auto input = view(centers);
  return wrap(without_gil([&] { return classify_halted(graph, input, reach, n_threads); }));
}

auto bind_update_centers(const Rows<double>& positions, const Array<double>& measures,
                         const Array<Label>& labels, Label n_regions) {
  const auto input = std::tuple(points(positions), view(measures), view(labels));
  return to_numpy(without_gil([&] {
    return update_centers(std::get<0>(input), std::get<1>(input), std::get<2>(input), n_regions);
  }));
}

}  // namespace
}  // namespace superfacets

NB_MODULE(_core, module) {
  using namespace superfacets;
  module.def("weld_vertices", &bind_weld_vertices, "vertices"_a.noconvert());
  module.def("build_face_graph", &bind_build_face_graph, "faces"_a.noconvert(),
             "representative"_a.noconvert());
  module.def("measure_faces", &bind_measure_faces, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "n_threads"_a);
  module.def("superfacet_weights", &bind_superfacet_weights, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "centroids"_a.noconvert(), "areas"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "sides"_a.noconvert(),
             "same_turn"_a.noconvert(), "alpha"_a, "eta_convex"_a, "diagonal"_a, "inside_out"_a,
             "n_threads"_a);
  module.def("count_degenerate", &bind_count_degenerate, "vertices"_a.noconvert(),
             "faces"_a.noconvert());
  module.def("signed_volume", &bind_signed_volume, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "origin"_a);
  module.def("quantize_weights", &bind_quantize_weights, "weights"_a.noconvert());
  module.def("weighted_mean", &bind_weighted_mean, "positions"_a.noconvert(),
             "measures"_a.noconvert());
  module.def("nearest_cell", &bind_nearest_cell, "positions"_a.noconvert(), "target"_a);
  module.def("farthest_seeds", &bind_farthest_seeds, "positions"_a.noconvert(), "first"_a,
             "n_seeds"_a);
  module.def("flood_seeds", &bind_flood_seeds, "positions"_a.noconvert(), "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "lengths"_a.noconvert(), "first"_a, "reach"_a);
  module.def("grid_labels", &bind_grid_labels, "positions"_a.noconvert(), "corner"_a, "side"_a);
  module.def("classify_exact", &bind_classify_exact, "positions"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "lengths"_a.noconvert(),
             "centers"_a.noconvert());
  module.def("reclassify_exact", &bind_reclassify_exact, "positions"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "lengths"_a.noconvert(),
             "centers"_a.noconvert(), "previous_labels"_a.noconvert(),
             "previous_lengths"_a.noconvert(), "previous_centers"_a.noconvert());
  module.def("classify_halted", &bind_classify_halted, "positions"_a.noconvert(),
             "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "lengths"_a.noconvert(),
             "centers"_a.noconvert(), "reach"_a, "n_threads"_a);
  module.def("update_centers", &bind_update_centers, "positions"_a.noconvert(),
             "measures"_a.noconvert(), "labels"_a.noconvert(), "n_regions"_a);
}
