// Bindings of stages 3 and 4. The functions are documented in the headers of clustering/. Their
// preconditions are checked by superfacets/base/checks.py.
#include "clustering/clustering.hpp"

#include "bindings/bindings.hpp"
#include "clustering/coarse_graph.hpp"
#include "clustering/loose_pieces.hpp"
#include "clustering/seeding.hpp"

namespace superfacets {
namespace {

std::vector<Cell> centers_of(const OrderedGraph& graph, Integers labels, Label n_regions,
                             ThreadTeam& team) {
  Buffer<Label> by_place(labels.size());
  for (std::size_t place = 0; place < labels.size(); ++place) {
    by_place[place] = labels[graph.cell_at(place)];
  }
  return graph.cells_at(update_centers(graph, by_place.span(), n_regions, team));
}

void make_clustering(Clustering* self, const OrderedGraph& graph, Integers centers, double reach,
                     int n_threads, Islands islands, PathArrays* paths) {
  without_gil([&] { new (self) Clustering(graph, centers, reach, islands, paths, n_threads); });
}

auto relocated(Clustering& clustering, std::int64_t n_moves, int n_threads) {
  const auto work = [&](ThreadTeam& team) { return clustering.relocate(n_moves, team); };
  return on_team(clustering.graph().n_cells(), n_threads, work, kMinSlowPerThread);
}

void make_coarse_graph(CoarseGraph* self, const OrderedGraph& fine, Place cell_size,
                       int n_threads) {
  const auto make = [&](ThreadTeam& team) { new (self) CoarseGraph(fine, cell_size, team); };
  on_team(fine.n_cells(), n_threads, make, kMinSlowPerThread);
}

auto arcs_of(const CoarseGraph& coarse) {
  const OrderedGraph& graph = coarse.graph();
  Buffer<Place> targets(graph.arcs.size());
  Buffer<float> lengths(graph.arcs.size());
  std::ranges::transform(graph.arcs, targets.begin(), &Arc::to);
  std::ranges::transform(graph.arcs, lengths.begin(), &Arc::length);
  return std::tuple(copy_of(graph.offsets.span()), std::move(targets), std::move(lengths));
}

// Returns the positions and measures of the coarse cells.
auto cells_of(const CoarseGraph& coarse) {
  const OrderedGraph& graph = coarse.graph();
  return std::tuple(std::vector(graph.positions.begin(), graph.positions.end()),
                    std::vector(graph.measures.begin(), graph.measures.end()));
}

Buffer<float> means_of(const CoarseGraph& coarse, const Table<float>& rows, Integers group_of,
                       ThreadTeam& team) {
  return coarse.means_of({rows.shape(1), values_of(rows), group_of}, team);
}

void far_coarse_arcs(CoarseGraph& coarse, ThreadTeam& team) {
  coarse.add_far_arcs(team);
}

void add_costs_to_coarse(CoarseGraph& coarse, const Table<float>& vectors, double factor,
                         ThreadTeam& team) {
  coarse.add_part_costs({vectors.shape(1), values_of(vectors), {}}, factor, team);
}

using Lengths = std::span<const PathLength>;

auto spread_paths(CoarseGraph& coarse, Lengths lengths, Integers labels, Integers centers,
                  int n_threads, bool needs_lengths) {
  return on_team(coarse.fine().n_cells(), n_threads, [&](ThreadTeam& team) {
    return coarse.spread(lengths, labels, centers, needs_lengths, team);
  });
}

Buffer<Label> without_loose_pieces(Offsets offsets, Integers neighbors, Floats lengths,
                                   double crease_limit, Integers labels, Integers centers,
                                   ThreadTeam& team) {
  return join_loose_pieces({offsets, neighbors}, lengths, labels, centers, crease_limit, team);
}

}  // namespace

void bind_clustering(nb::module_& module) {
  module.def("central_cell", threaded(&central_cell), "graph"_a, "n_threads"_a);
  nb::enum_<Islands>(module, "Islands")
      .value("KEEP", Islands::kKeep)
      .value("NEAREST", Islands::kNearest);
  const nb::class_<PathArrays> paths(module, "PathArrays");
  module.def("n_cells_of_large_components", threaded(&n_cells_of_large_components), "graph"_a,
             "n_seeds"_a, "n_threads"_a);
  module.def("farthest_seeds", threaded(&farthest_seeds), "graph"_a, "first"_a, "n_seeds"_a,
             "islands"_a, "n_threads"_a);
  module.def("geodesic_seeds", threaded(&geodesic_seeds), "graph"_a, "first"_a, "n_seeds"_a,
             "n_threads"_a);
  module.def("curve_seeds", threaded(&curve_seeds), "graph"_a, "first"_a, "n_seeds"_a,
             "n_threads"_a);
  module.def("flood_seeds", threaded(&flood_seeds), "graph"_a, "first"_a, "n_seeds"_a, "reach"_a,
             "islands"_a, "n_threads"_a);
  module.def("grid_seeds", threaded(&grid_seeds), "graph"_a, "corner"_a, "side"_a, "n_threads"_a);
  nb::class_<Clustering>(module, "Clustering")
      .def("__init__", &make_clustering, "graph"_a, "centers"_a, "reach"_a, "n_threads"_a,
           "islands"_a = Islands::kKeep, "paths"_a.none() = nb::none(), nb::keep_alive<1, 2>(),
           "The arrays of `paths` are moved, so `paths` is empty afterwards.")
      .def("classify", serial([](Clustering& self, Integers centers) { self.classify(centers); }),
           "centers"_a)
      .def("update", serial([](Clustering& self) { return self.update(); }))
      .def("relocate", &relocated, "n_moves"_a, "n_threads"_a)
      .def("centers", serial([](const Clustering& self) { return self.centers(); }))
      .def("labels", serial([](Clustering& self) { return self.labels(); }))
      .def("lengths", serial([](Clustering& self) { return self.lengths(); }));
  nb::class_<CoarseGraph>(module, "CoarseGraph")
      .def("__init__", &make_coarse_graph, "fine"_a, "cell_size"_a, "n_threads"_a,
           nb::keep_alive<1, 2>())
      .def_prop_ro("graph", &CoarseGraph::graph, nb::rv_policy::reference_internal)
      .def("coarse_cells", threaded([](const CoarseGraph& coarse, ThreadTeam& team) {
             return coarse.coarse_cells({}, team);
           }),
           "n_threads"_a)
      .def("groups_of_cells",
           threaded([](const CoarseGraph& coarse, Integers groups, ThreadTeam& team) {
             return coarse.coarse_cells(groups, team);
           }),
           "groups"_a, "n_threads"_a)
      .def("centers", serial([](const CoarseGraph& coarse) { return coarse.centers(); }))
      .def("arcs", serial(&arcs_of))
      .def("cells", serial(&cells_of))
      .def("add_far_arcs", threaded<kMinSlowPerThread>(&far_coarse_arcs), "n_threads"_a)
      .def("means_of", threaded<kMinSlowPerThread>(&means_of), "rows"_a.noconvert(), "group_of"_a,
           "n_threads"_a)
      .def("add_part_costs", threaded<kMinSlowPerThread>(&add_costs_to_coarse),
           "vectors"_a.noconvert(), "factor"_a, "n_threads"_a)
      .def("set_lengths", threaded([](CoarseGraph& coarse, Floats lengths, ThreadTeam& team) {
             coarse.set_lengths(lengths, team);
           }),
           "lengths"_a, "n_threads"_a)
      .def("spread", &spread_paths, "lengths"_a, "labels"_a, "centers"_a, "n_threads"_a,
           nb::kw_only(), "needs_lengths"_a = true)
      .def("refine",
           threaded([](const CoarseGraph& coarse, Integers labels, Integers centers,
                       ThreadTeam& team) { return coarse.refine(labels, centers, team); }),
           "labels"_a, "centers"_a, "n_threads"_a);
  module.def("join_loose_pieces", threaded(&without_loose_pieces), "offsets"_a, "neighbors"_a,
             "lengths"_a, "crease_limit"_a, "labels"_a, "centers"_a, "n_threads"_a);
  module.def("join_islands", threaded(&join_islands), "graph"_a, "labels"_a, "groups"_a,
             "n_threads"_a);
  module.def("update_centers", threaded(&centers_of), "graph"_a, "labels"_a, "n_regions"_a,
             "n_threads"_a);
}

}  // namespace superfacets
