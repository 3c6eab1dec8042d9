// Bindings of stages 3 and 4. The headers of the stages describe the functions;
// superfacets/_validate.py ensures their preconditions.
#include "clustering/clustering.hpp"

#include <new>

#include "base/threads.hpp"
#include "bindings/bindings.hpp"
#include "cells/polygon_surface.hpp"
#include "cells/triangle_surface.hpp"
#include "clustering/coarse_sums.hpp"
#include "clustering/coarse_tile.hpp"
#include "clustering/coarsening.hpp"
#include "clustering/fixed_point.hpp"
#include "clustering/islands.hpp"
#include "clustering/seeding.hpp"
#include "clustering/update.hpp"
#include "mesh/geometry.hpp"
#include "paths/tile_paths.hpp"

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

// Positions and measures.
auto bind_cells_of_coarse(const CoarseGraph& coarse) {
  const OrderedGraph& graph = coarse.graph();
  std::vector<Point> positions(graph.positions.begin(), graph.positions.end());
  std::vector<double> measures(graph.measures.begin(), graph.measures.end());
  return std::tuple(to_numpy(std::move(positions)), to_numpy(std::move(measures)));
}

auto bind_crossing_conductances(const CoarseGraph& coarse, const Array<double>& areas, double unit,
                                double crease_unit, double steepness, int n_threads) {
  const auto input = view(areas);
  const CrossingOptions options{unit, crease_unit, steepness};
  return to_numpy(on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    return crossing_conductances(coarse, input, options, team);
  }));
}

auto bind_triangle_area_vectors(const CoarseGraph& coarse, const TriangleSurface& surface,
                                int n_threads) {
  const auto vector_of = [&](Cell face) {
    return 0.5 * double_area_vector(surface.vertices(), surface.faces()[face]);
  };
  return to_numpy(on_team(surface.n_cells(), n_threads,
                          [&](ThreadTeam& team) { return coarse_sums(coarse, vector_of, team); }));
}

auto bind_polygon_area_vectors(const CoarseGraph& coarse, const PolygonSurface& surface,
                               int n_threads) {
  const auto vector_of = [&](Cell face) { return surface.measure(face) * surface.normal(face); };
  return to_numpy(on_team(surface.n_cells(), n_threads,
                          [&](ThreadTeam& team) { return coarse_sums(coarse, vector_of, team); }));
}

auto bind_coarse_steps(const CoarseGraph& coarse, int n_threads) {
  return to_numpy(on_team(coarse.graph().n_cells(), n_threads,
                          [&](ThreadTeam& team) { return coarse_steps(coarse, team); }));
}

auto bind_refine(const CoarseGraph& coarse, const Array<Label>& labels, const Array<Cell>& centers,
                 int n_threads) {
  const auto by_cell = view(labels);
  const auto some_cells = view(centers);
  return to_numpy(on_team(coarse.graph().n_cells(), n_threads, [&](ThreadTeam& team) {
    return coarse.refine(by_cell, some_cells, team);
  }));
}

constexpr std::size_t kNumbersPerSum = 8;

std::vector<std::int64_t> rows_of(std::span<const FixedSum> sums) {
  std::vector<std::int64_t> rows;
  rows.reserve(kNumbersPerSum * sums.size());
  for (const FixedSum& sum : sums) {
    rows.insert(rows.end(), sum.upper.begin(), sum.upper.end());
    rows.insert(rows.end(), sum.lower.begin(), sum.lower.end());
  }
  return rows;
}

std::vector<FixedSum> sums_of_rows(std::span<const std::int64_t> rows) {
  std::vector<FixedSum> sums(rows.size() / kNumbersPerSum);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const auto row = rows.subspan(kNumbersPerSum * i, kNumbersPerSum);
    std::copy_n(row.begin(), 4, sums[i].upper.begin());
    std::copy_n(row.begin() + 4, 4, sums[i].lower.begin());
  }
  return sums;
}

auto bind_divide_tile(const OrderedGraph& tile, Place n_own, Place cell_size, int n_threads) {
  TileCells cells = on_team(n_own, n_threads, [&](ThreadTeam& team) {
    return divide_tile(tile, n_own, cell_size, team);
  });
  return std::tuple(to_numpy(std::move(cells.centers)), to_numpy(std::move(cells.positions)),
                    to_numpy(std::move(cells.measures)), to_numpy(std::move(cells.of)),
                    to_numpy(std::move(cells.lengths)));
}

auto bind_connect_tile(const Array<std::int64_t>& offsets, const Array<Place>& arc_targets,
                       const Array<float>& arc_lengths, const Array<Cell>& coarse,
                       const Array<float>& coarse_lengths, int n_threads) {
  const PathArcs input{view(offsets), view(arc_targets), view(arc_lengths)};
  const auto cells = std::pair(view(coarse), view(coarse_lengths));
  TileArcs joined = on_team(cells.first.size(), n_threads, [&](ThreadTeam& team) {
    const auto n_own = static_cast<Place>(input.offsets.size() - 1);
    const OrderedGraph tile = graph_of_arcs(input, cells.first.size());
    return connect_tile(tile, n_own, cells.first, cells.second, team);
  });
  std::vector<Cell> targets;
  std::vector<float> lengths;
  for (const Arc& arc : joined.arcs) {
    targets.push_back(arc.to);
    lengths.push_back(arc.length);
  }
  return std::tuple(to_numpy(std::move(joined.offsets)), to_numpy(std::move(targets)),
                    to_numpy(std::move(lengths)));
}

auto bind_improve_paths(const Array<std::int64_t>& offsets, const Array<Place>& targets,
                        const Array<float>& arc_lengths, const Array<PathLength>& lengths,
                        const Array<Label>& labels, const Array<Place>& places,
                        const Array<PathLength>& proposed_lengths,
                        const Array<Label>& proposed_labels, int n_threads) {
  const PathArcs arcs{view(offsets), view(targets), view(arc_lengths)};
  const auto known = std::pair(view(lengths), view(labels));
  const PathProposals proposals{view(places), view(proposed_lengths), view(proposed_labels)};
  TilePaths paths = on_team(known.first.size(), n_threads, [&](ThreadTeam& team) {
    return improve_paths(arcs, known.first, known.second, proposals, team);
  });
  return std::tuple(to_numpy(std::move(paths.lengths)), to_numpy(std::move(paths.labels)));
}

auto bind_region_means(const OrderedGraph& coarse, const Array<Label>& labels, Label n_regions) {
  const auto input = view(labels);
  return to_numpy(without_gil([&] { return region_means(coarse, input, n_regions); }));
}

auto bind_nearest_of_regions(const Rows<double>& positions, const Array<Cell>& cells,
                             const Array<Label>& labels, const Rows<double>& targets) {
  const auto input = std::tuple(points(positions), view(cells), view(labels), points(targets));
  NearestOfRegions nearest = without_gil([&] { return std::apply(nearest_of_regions, input); });
  return std::tuple(to_numpy(std::move(nearest.squared_distances)),
                    to_numpy(std::move(nearest.cells)));
}

// The exact sums of regions, rows of eight whole numbers, which may be added in any order.
auto bind_fixed_sums(const Rows<double>& positions, const Array<double>& measures,
                     const Array<Label>& labels, Label n_regions,
                     const std::tuple<double, double, double>& low,
                     const std::tuple<double, double, double>& high, double total_measure) {
  const auto input = std::tuple(points(positions), view(measures), view(labels));
  const FixedPoint fixed({as_point(low), as_point(high)}, total_measure);
  std::vector<std::int64_t> rows = without_gil([&] {
    const auto [where, how_much, regions] = input;
    return rows_of(region_sums(fixed, where, how_much, regions, n_regions));
  });
  return to_numpy(std::move(rows));
}

// Their means, and whether their measure is too small for these.
auto bind_fixed_means(const Array<std::int64_t>& rows,
                      const std::tuple<double, double, double>& low,
                      const std::tuple<double, double, double>& high, double total_measure) {
  const FixedPoint fixed({as_point(low), as_point(high)}, total_measure);
  std::vector<Point> means;
  std::vector<std::uint8_t> is_small;
  for (const FixedSum& sum : sums_of_rows(view(rows))) {
    is_small.push_back(static_cast<std::uint8_t>(FixedPoint::is_too_small(sum)));
    means.push_back(is_small.back() != 0 ? Point{0.0, 0.0, 0.0} : fixed.mean(sum));
  }
  return std::tuple(to_numpy(std::move(means)), to_numpy(std::move(is_small)));
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
      .def("cells", &bind_cells_of_coarse)
      .def("crossing_conductances", &bind_crossing_conductances, "areas"_a.noconvert(), "unit"_a,
           "crease_unit"_a, "steepness"_a, "n_threads"_a)
      .def("steps", &bind_coarse_steps, "n_threads"_a)
      .def("area_vectors", &bind_triangle_area_vectors, "surface"_a, "n_threads"_a)
      .def("area_vectors", &bind_polygon_area_vectors, "surface"_a, "n_threads"_a)
      .def("refine", &bind_refine, "labels"_a.noconvert(), "centers"_a.noconvert(), "n_threads"_a);
  module.def("join_islands", &bind_join_islands, "graph"_a, "labels"_a.noconvert(),
             "groups"_a.noconvert(), "n_threads"_a);
  module.def("divide_tile", &bind_divide_tile, "tile"_a, "n_own"_a, "cell_size"_a, "n_threads"_a);
  module.def("connect_tile", &bind_connect_tile, "offsets"_a.noconvert(),
             "arc_targets"_a.noconvert(), "arc_lengths"_a.noconvert(), "coarse"_a.noconvert(),
             "coarse_lengths"_a.noconvert(), "n_threads"_a);
  module.def("improve_paths", &bind_improve_paths, "offsets"_a.noconvert(), "targets"_a.noconvert(),
             "arc_lengths"_a.noconvert(), "lengths"_a.noconvert(), "labels"_a.noconvert(),
             "places"_a.noconvert(), "proposed_lengths"_a.noconvert(),
             "proposed_labels"_a.noconvert(), "n_threads"_a);
  module.def("region_means", &bind_region_means, "coarse"_a, "labels"_a.noconvert(), "n_regions"_a);
  module.def("nearest_of_regions", &bind_nearest_of_regions, "positions"_a.noconvert(),
             "cells"_a.noconvert(), "labels"_a.noconvert(), "targets"_a.noconvert());
  module.def("fixed_sums", &bind_fixed_sums, "positions"_a.noconvert(), "measures"_a.noconvert(),
             "labels"_a.noconvert(), "n_regions"_a, "low"_a, "high"_a, "total_measure"_a);
  module.def("fixed_means", &bind_fixed_means, "rows"_a.noconvert(), "low"_a, "high"_a,
             "total_measure"_a);
  module.def("update_centers", &bind_update_centers, "graph"_a, "labels"_a.noconvert(),
             "n_regions"_a, "n_threads"_a);
}

}  // namespace superfacets
