// Bindings of stages 3 and 4. What each function does stands in the header of its stage; what it
// may assume, in superfacets/_validate.py.
#include "bindings.hpp"
#include "classify.hpp"
#include "seeding.hpp"
#include "update.hpp"

namespace superfacets {
namespace {

CellGraph cell_graph(const Rows<double>& positions, const Array<std::int64_t>& offsets,
                     const Array<Cell>& neighbors, const Array<float>& lengths) {
  return {points(positions), view(offsets), view(neighbors), view(lengths)};
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

void bind_cell_stages(nb::module_& module) {
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

}  // namespace superfacets
