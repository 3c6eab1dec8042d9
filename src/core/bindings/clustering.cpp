// Bindings of stages 3 and 4. The headers of the stages describe the functions;
// superfacets/_validate.py ensures their preconditions.
#include "clustering/clustering.hpp"

#include <new>

#include "base/threads.hpp"
#include "bindings/bindings.hpp"
#include "clustering/coarsening.hpp"
#include "clustering/islands.hpp"
#include "clustering/seeding.hpp"
#include "clustering/update.hpp"

namespace superfacets {
namespace {

Cell bind_central_cell(const OrderedGraph& graph, int n_threads) {
  return on_team(graph.n_cells(), n_threads,
                 [&](ThreadTeam& team) { return central_cell(graph, team); });
}

std::int64_t bind_n_cells_of_large_components(const OrderedGraph& graph, Cell n_seeds,
                                              int n_threads) {
  return on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    return n_cells_of_large_components(graph, n_seeds, team);
  });
}

auto bind_farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, Islands islands,
                         int n_threads) {
  return to_numpy(on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    return farthest_seeds(graph, first, n_seeds, islands, team);
  }));
}

auto bind_geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, int n_threads) {
  return to_numpy(on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    return geodesic_seeds(graph, first, n_seeds, team);
  }));
}

auto bind_flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                      Islands islands, int n_threads) {
  return to_numpy(on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    return flood_seeds(graph, first, n_seeds, reach, islands, team);
  }));
}

auto bind_grid_seeds(const OrderedGraph& graph, const std::tuple<double, double, double>& corner,
                     double side, int n_threads) {
  const Point low = as_point(corner);
  return to_numpy(on_team(graph.n_cells(), n_threads,
                          [&](ThreadTeam& team) { return grid_seeds(graph, low, side, team); }));
}

void bind_clustering(Clustering* self, const OrderedGraph& graph, const Array<Cell>& centers,
                     double reach, int n_threads, Islands islands) {
  const auto input = view(centers);
  without_gil([&] { return new (self) Clustering(graph, input, reach, islands, n_threads); });
}

void bind_classify(Clustering& clustering, const Array<Cell>& centers) {
  const auto input = view(centers);
  without_gil([&] { clustering.classify(input); });
}

auto bind_update(Clustering& clustering) {
  return to_numpy(without_gil([&] { return clustering.update(); }));
}

auto bind_relocate(Clustering& clustering, std::int64_t n_moves) {
  return to_numpy(without_gil([&] { return clustering.relocate(n_moves); }));
}

auto bind_centers(const Clustering& clustering) {
  return to_numpy(clustering.centers());
}

auto bind_labels(Clustering& clustering) {
  return to_numpy(without_gil([&] { return clustering.labels(); }));
}

auto bind_lengths(Clustering& clustering) {
  return to_numpy(without_gil([&] { return clustering.lengths(); }));
}

auto bind_join_islands(const OrderedGraph& graph, const Array<Label>& labels,
                       const Array<Label>& groups, int n_threads) {
  const auto input = std::pair(view(labels), view(groups));
  JoinedIslands joined = on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    return join_islands(graph, input.first, input.second, team);
  });
  return std::tuple(to_numpy(std::move(joined.labels)), joined.n_joined,
                    to_numpy(std::move(joined.new_centers)));
}

auto bind_update_centers(const OrderedGraph& graph, const Array<Label>& labels, Label n_regions,
                         int n_threads) {
  const auto input = view(labels);
  return to_numpy(on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) {
    Buffer<Label> by_place(input.size());
    for (std::size_t place = 0; place < input.size(); ++place) {
      by_place[place] = input[graph.cells[place]];
    }
    return graph.cells_at(update_centers(graph, by_place.span(), n_regions, team));
  }));
}

void bind_coarse_graph(CoarseGraph* self, const OrderedGraph& fine, Place cell_size,
                       int n_threads) {
  on_team(fine.n_cells(), n_threads,
          [&](ThreadTeam& team) { return new (self) CoarseGraph(fine, cell_size, team); });
}

auto bind_coarse_cells(const CoarseGraph& coarse, int n_threads) {
  return to_numpy(on_team(coarse.graph().n_cells(), n_threads,
                          [&](ThreadTeam& team) { return coarse.coarse_cells(team); }));
}

auto bind_coarse_centers(const CoarseGraph& coarse) {
  return to_numpy(coarse.centers());
}

// For tests.
auto bind_coarse_arcs(const CoarseGraph& coarse) {
  const OrderedGraph& graph = coarse.graph();
  std::vector<std::int64_t> offsets(graph.offsets.begin(), graph.offsets.end());
  std::vector<Cell> neighbors;
  std::vector<float> lengths;
  for (const Arc& arc : graph.arcs.span()) {
    neighbors.push_back(arc.to);
    lengths.push_back(arc.length);
  }
  return std::tuple(to_numpy(std::move(offsets)), to_numpy(std::move(neighbors)),
                    to_numpy(std::move(lengths)));
}

auto bind_refine(const CoarseGraph& coarse, const Array<Label>& labels, const Array<Cell>& centers,
                 int n_threads) {
  const auto by_cell = view(labels);
  const auto some_cells = view(centers);
  return to_numpy(on_team(coarse.graph().n_cells(), n_threads, [&](ThreadTeam& team) {
    return coarse.refine(by_cell, some_cells, team);
  }));
}

}  // namespace

void bind_clustering_stages(nb::module_& module) {
  module.def("central_cell", &bind_central_cell, "graph"_a, "n_threads"_a);
  nb::enum_<Islands>(module, "Islands")
      .value("KEEP", Islands::kKeep)
      .value("NEAREST", Islands::kNearest);
  module.def("n_cells_of_large_components", &bind_n_cells_of_large_components, "graph"_a,
             "n_seeds"_a, "n_threads"_a);
  module.def("farthest_seeds", &bind_farthest_seeds, "graph"_a, "first"_a, "n_seeds"_a, "islands"_a,
             "n_threads"_a);
  module.def("geodesic_seeds", &bind_geodesic_seeds, "graph"_a, "first"_a, "n_seeds"_a,
             "n_threads"_a);
  module.def("flood_seeds", &bind_flood_seeds, "graph"_a, "first"_a, "n_seeds"_a, "reach"_a,
             "islands"_a, "n_threads"_a);
  module.def("grid_seeds", &bind_grid_seeds, "graph"_a, "corner"_a, "side"_a, "n_threads"_a);
  nb::class_<Clustering>(module, "Clustering")
      .def("__init__", &bind_clustering, "graph"_a, "centers"_a.noconvert(), "reach"_a,
           "n_threads"_a, "islands"_a = Islands::kKeep, nb::keep_alive<1, 2>())
      .def("classify", &bind_classify, "centers"_a.noconvert())
      .def("update", &bind_update)
      .def("relocate", &bind_relocate, "n_moves"_a)
      .def("centers", &bind_centers)
      .def("labels", &bind_labels)
      .def("lengths", &bind_lengths);
  nb::class_<CoarseGraph>(module, "CoarseGraph")
      .def("__init__", &bind_coarse_graph, "fine"_a, "cell_size"_a, "n_threads"_a,
           nb::keep_alive<1, 2>())
      .def_prop_ro("graph", &CoarseGraph::graph, nb::rv_policy::reference_internal)
      .def("coarse_cells", &bind_coarse_cells, "n_threads"_a)
      .def("centers", &bind_coarse_centers)
      .def("arcs", &bind_coarse_arcs)
      .def("refine", &bind_refine, "labels"_a.noconvert(), "centers"_a.noconvert(), "n_threads"_a);
  module.def("join_islands", &bind_join_islands, "graph"_a, "labels"_a.noconvert(),
             "groups"_a.noconvert(), "n_threads"_a);
  module.def("update_centers", &bind_update_centers, "graph"_a, "labels"_a.noconvert(),
             "n_regions"_a, "n_threads"_a);
}

}  // namespace superfacets
