// Bindings of stages 1 and 2. The headers of the stages describe the functions;
// superfacets/_validate.py ensures their preconditions.
#include <new>

#include "base/logarithm.hpp"
#include "bindings/bindings.hpp"
#include "cells/components.hpp"
#include "cells/face_graph.hpp"
#include "cells/feature_steps.hpp"
#include "cells/graph_surface.hpp"
#include "cells/ordered_graph.hpp"
#include "cells/part_weights.hpp"
#include "cells/point_graph.hpp"
#include "cells/point_surface.hpp"
#include "cells/polygon_graph.hpp"
#include "cells/polygon_surface.hpp"
#include "cells/sub_surface.hpp"
#include "cells/surface_weights.hpp"
#include "cells/tet_graph.hpp"
#include "cells/tet_surface.hpp"
#include "cells/triangle_surface.hpp"
#include "cells/turning.hpp"
#include "cells/weights.hpp"
#include "spatial/morton.hpp"
#include "spatial/nearest_cell.hpp"
#include "spatial/point_tiles.hpp"
#include "spatial/ray_thickness.hpp"
#include "spectral/diffusion.hpp"
#include "spectral/eigenvectors.hpp"

namespace superfacets {
namespace {

// Surfaces view arrays that keep_alive holds on to.
void bind_triangle_surface(TriangleSurface* self, const Rows<double>& vertices,
                           const Rows<Vertex>& faces, const Array<std::int64_t>& offsets,
                           const Array<Face>& neighbors, const Array<std::uint8_t>& sides,
                           const Array<std::uint8_t>& same_turn, bool inside_out) {
  new (self) TriangleSurface(points(vertices), triangles(faces), {view(offsets), view(neighbors)},
                             view(sides), view(same_turn), inside_out);
}

void bind_polygon_surface(PolygonSurface* self, const Rows<double>& vertices,
                          const Array<std::int64_t>& face_offsets, const Array<Vertex>& corners,
                          const Array<std::int64_t>& offsets, const Array<Face>& neighbors,
                          const Array<std::int32_t>& sides, const Array<std::uint8_t>& same_turn,
                          bool inside_out, int n_threads) {
  const auto input = std::pair(points(vertices), polygons(face_offsets, corners));
  const Arcs arcs{view(offsets), view(neighbors)};
  on_team(static_cast<std::size_t>(arcs.n_cells()), n_threads, [&](ThreadTeam& team) {
    return new (self) PolygonSurface(input.first, input.second, arcs, view(sides), view(same_turn),
                                     inside_out, team);
  });
}

void bind_graph_surface(GraphSurface* self, const Rows<double>& positions,
                        const Array<double>& measures, const Array<std::int64_t>& offsets,
                        const Array<Cell>& neighbors, const Array<double>& border_lengths,
                        const Array<double>& step_lengths, const Array<double>& angles,
                        const Array<std::int32_t>& sides, const Array<double>& open_lengths) {
  new (self) GraphSurface({view(offsets), view(neighbors)},
                          {points(positions), view(measures), view(border_lengths),
                           view(step_lengths), view(angles), view(sides), view(open_lengths)});
}

using TetRows = nb::ndarray<const Vertex, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;

std::span<const Tet> tet_span(const TetRows& tets) {
  return {reinterpret_cast<const Tet*>(tets.data()), tets.shape(0)};
}

void bind_tet_surface(TetSurface* self, const Rows<double>& vertices, const TetRows& tets,
                      const Rows<double>& positions, const Array<double>& volumes,
                      const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                      const Array<double>& border_areas, const Array<double>& step_lengths,
                      const Array<std::int32_t>& sides, const Array<double>& open_areas) {
  new (self) TetSurface(points(vertices), tet_span(tets), {view(offsets), view(neighbors)},
                        {points(positions),
                         view(volumes),
                         view(border_areas),
                         view(step_lengths),
                         {},
                         view(sides),
                         view(open_areas)});
}

void bind_point_surface(PointSurface* self, const Rows<double>& positions,
                        const Array<double>& areas, const Rows<double>& normals,
                        const Array<Cell>& order, const Array<std::int64_t>& offsets,
                        const Array<Cell>& neighbors) {
  new (self) PointSurface(points(positions), view(areas), points(normals), view(order),
                          {view(offsets), view(neighbors)});
}

void bind_sub_surface(SubSurface* self, const Surface& whole, const Array<std::int64_t>& offsets,
                      const Array<Cell>& neighbors, const Array<Cell>& kept_cells,
                      const Array<std::int64_t>& kept_arcs) {
  new (self)
      SubSurface(whole, {view(offsets), view(neighbors)}, {view(kept_cells), view(kept_arcs)});
}

auto bind_surface_cells(const Surface& surface, int n_threads) {
  Buffer<Point> positions(surface.n_cells());
  Buffer<double> measures(surface.n_cells());
  on_team(positions.size(), n_threads, [&](ThreadTeam& team) {
    team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
      for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
        positions[cell] = surface.position(cell);
        measures[cell] = surface.measure(cell);
      }
    });
  });
  return std::tuple(to_numpy(std::move(positions)), to_numpy(std::move(measures)));
}

auto bind_arc_measures(const Surface& surface, int n_threads) {
  Buffer<double> border_lengths(surface.arcs().n_arcs());
  Buffer<double> step_lengths(surface.arcs().n_arcs());
  Buffer<double> angles(surface.arcs().n_arcs());
  Buffer<std::int32_t> sides(surface.arcs().n_arcs());
  Buffer<double> open_lengths(surface.n_cells());
  on_team(open_lengths.size(), n_threads, [&](ThreadTeam& team) {
    team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
      for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
        open_lengths[cell] = surface.open_length(cell);
        for (const auto [arc, neighbor] : surface.arcs().steps(cell)) {
          border_lengths[arc] = surface.border_length(cell, arc);
          step_lengths[arc] = surface.step_length(cell, arc);
          angles[arc] = surface.angle(cell, arc);
          sides[arc] = surface.side(cell, arc);
        }
      }
    });
  });
  return std::tuple(to_numpy(std::move(border_lengths)), to_numpy(std::move(step_lengths)),
                    to_numpy(std::move(angles)), to_numpy(std::move(sides)),
                    to_numpy(std::move(open_lengths)));
}

double bind_sum_of(const Array<double>& values, int n_threads) {
  const auto input = view(values);
  return on_team(input.size(), n_threads, [&](ThreadTeam& team) { return sum_of(input, team); });
}

auto bind_ray_thickness(const Rows<double>& vertices, const Rows<Vertex>& faces,
                        const Rows<double>& starts, const Rows<double>& axes, int n_rays,
                        double least_distance, bool inside_out, int n_threads) {
  const auto mesh = std::pair(points(vertices), triangles(faces));
  const auto input = std::pair(points(starts), points(axes));
  const RayOptions options{n_rays, least_distance, inside_out};
  return to_numpy(
      on_team(mesh.second.size() + 100 * input.first.size(), n_threads, [&](ThreadTeam& team) {
        return ray_thickness(mesh.first, mesh.second, input.first, input.second, options, team);
      }));
}

auto bind_logarithms(const Array<double>& values) {
  const auto input = view(values);
  std::vector<double> logarithms;
  logarithms.reserve(input.size());
  for (const double value : input) logarithms.push_back(logarithm(value));
  return to_numpy(std::move(logarithms));
}

auto bind_crease_conductances(const Surface& surface, const Array<double>& areas,
                              const Array<double>& weights, double diagonal, double crease_unit,
                              double steepness, int n_threads) {
  const CreaseConductance formula{
      surface, view(areas), view(weights), {diagonal, crease_unit, steepness}};
  Conductances found = on_team(areas.shape(0), n_threads, [&](ThreadTeam& team) {
    return crease_conductances(formula, team);
  });
  return std::tuple(to_numpy(std::move(found.steps)), to_numpy(std::move(found.conductances)));
}

auto bind_hindered_conductances(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                                const Array<double>& conductances, const Array<double>& values,
                                double steepness, int n_threads) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto input = std::pair(view(conductances), view(values));
  return to_numpy(on_team(input.second.size(), n_threads, [&](ThreadTeam& team) {
    return hindered_conductances(arcs, input.first, input.second, steepness, team);
  }));
}

auto bind_sum_between(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                      const Array<double>& conductances, const Array<double>& steps,
                      const Array<Cell>& coarse_of, const Array<std::int64_t>& coarse_offsets,
                      const Array<Cell>& coarse_neighbors) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const Arcs coarse{view(coarse_offsets), view(coarse_neighbors)};
  const auto input = std::tuple(view(conductances), view(steps), view(coarse_of));
  return to_numpy(without_gil([&] {
    return sum_between(arcs, std::get<0>(input), std::get<1>(input), std::get<2>(input), coarse);
  }));
}

auto bind_relax(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                const Array<double>& conductances, const Table<float>& rows, int n_sweeps,
                int n_threads) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto through = view(conductances);
  const std::span<const float> given{rows.data(), rows.size()};
  const std::size_t width = rows.shape(1);
  Buffer<float> relaxed(given.size());
  on_team(given.size(), n_threads, [&](ThreadTeam& team) {
    std::copy(given.begin(), given.end(), relaxed.begin());
    relax(arcs, through, width, n_sweeps, team, relaxed.span());
  });
  return to_numpy(std::move(relaxed));
}

auto bind_diffuse(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                  const Array<double>& conductances, const Array<double>& masses,
                  const Array<double>& values, double time, int n_threads) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto input = std::tuple(view(conductances), view(masses), view(values));
  return to_numpy(on_team(masses.shape(0), n_threads, [&](ThreadTeam& team) {
    return diffuse(arcs, std::get<0>(input), std::get<1>(input), std::get<2>(input), time, team);
  }));
}

auto bind_part_weights(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                       const Array<double>& weights, const Array<Cell>& group_of,
                       const Table<float>& vectors, const Array<double>& exponents, double factor,
                       int n_threads) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto given = view(weights);
  const PartFeatures features{
      view(group_of), vectors.shape(1), {vectors.data(), vectors.size()}, view(exponents), factor};
  Buffer<double> found(given.size());
  on_team(arcs.n_cells(), n_threads,
          [&](ThreadTeam& team) { part_weights(arcs, given, features, team, found.span()); });
  return to_numpy(std::move(found));
}

auto bind_smallest_eigenpairs(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                              const Array<double>& conductances, const Array<double>& measures,
                              const Array<Label>& components, Label n_components, int n_wanted) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto input = std::tuple(view(conductances), view(measures), view(components));
  Eigenpairs pairs = without_gil([&] {
    return smallest_eigenpairs(arcs, std::get<0>(input), std::get<1>(input), std::get<2>(input),
                               n_components, static_cast<std::size_t>(n_wanted));
  });
  return std::tuple(to_numpy(std::move(pairs.values)), to_numpy(std::move(pairs.vectors)));
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

auto bind_build_polygon_graph(const Array<std::int64_t>& offsets, const Array<Vertex>& corners,
                              const Array<Vertex>& representative, int n_threads) {
  const Polygons input = polygons(offsets, corners);
  const auto vertices = view(representative);
  const auto n_faces = static_cast<std::size_t>(input.n_faces());
  PolygonGraph graph = on_team(n_faces, n_threads, [&](ThreadTeam& team) {
    return build_polygon_graph(input, vertices, team);
  });
  const EdgeCounts& counts = graph.counts;
  return std::tuple(
      to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
      to_numpy(std::move(graph.sides)), to_numpy(std::move(graph.same_turn)),
      std::tuple(counts.edges, counts.boundary, counts.non_manifold, counts.inconsistent));
}

auto bind_build_tet_graph(const Rows<double>& vertices, const TetRows& tets,
                          const Array<Vertex>& representative, int n_threads) {
  const auto positions = points(vertices);
  const auto input = tet_span(tets);
  const auto lowest = view(representative);
  auto [graph, measures] = on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    PolygonGraph arcs = build_tet_graph(input, lowest, team);
    TetMeasures of_arcs = measure_tets(positions, input, arcs, team);
    return std::pair(std::move(arcs), std::move(of_arcs));
  });
  const EdgeCounts& counts = graph.counts;
  return std::tuple(
      to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
      to_numpy(std::move(graph.sides)), to_numpy(std::move(measures.centroids)),
      to_numpy(std::move(measures.volumes)), to_numpy(std::move(measures.border_areas)),
      to_numpy(std::move(measures.step_lengths)), to_numpy(std::move(measures.open_areas)),
      std::tuple(counts.edges, counts.boundary, counts.non_manifold));
}

PointGraph point_graph_of(const Rows<double>& positions, int n_neighbors, int n_around,
                          double cutoff, bool has_normals, int n_threads) {
  const auto input = points(positions);
  const PointGraphOptions options{static_cast<std::size_t>(n_neighbors),
                                  static_cast<std::size_t>(n_around), cutoff, has_normals};
  return on_team(input.size(), n_threads,
                 [&](ThreadTeam& team) { return build_point_graph(input, options, team); });
}

auto bind_build_sorted_point_graph(const Rows<double>& positions, int n_neighbors, int n_around,
                                   double cutoff, bool has_normals, int n_threads) {
  PointGraph graph =
      point_graph_of(positions, n_neighbors, n_around, cutoff, has_normals, n_threads);
  return std::tuple(to_numpy(std::move(graph.positions)), to_numpy(std::move(graph.offsets)),
                    to_numpy(std::move(graph.neighbors)), to_numpy(std::move(graph.measures)),
                    to_numpy(std::move(graph.normals)), to_numpy(std::move(graph.points)));
}

auto bind_build_point_graph(const Rows<double>& positions, int n_neighbors, int n_around,
                            double cutoff, bool has_normals, int n_threads) {
  PointGraph sorted =
      point_graph_of(positions, n_neighbors, n_around, cutoff, has_normals, n_threads);
  PointGraph graph = on_team(sorted.points.size(), n_threads,
                             [&](ThreadTeam& team) { return in_input_order(sorted, team); });
  return std::tuple(to_numpy(std::move(graph.offsets)), to_numpy(std::move(graph.neighbors)),
                    to_numpy(std::move(graph.measures)), to_numpy(std::move(graph.normals)),
                    to_numpy(std::move(sorted.points)));
}

auto bind_point_weights(const PointSurface& surface, double alpha, double eta_convex,
                        double crease_length, double diagonal, int n_threads) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const WeightOptions options{alpha, eta_convex, crease_length, diagonal};
  on_team(surface.n_cells(), n_threads,
          [&](ThreadTeam& team) { point_weights(surface, options, team, weights.span()); });
  return to_numpy(std::move(weights));
}

auto bind_add_feature_steps(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                            const Array<double>& weights, const Table<double>& features,
                            double factor, int n_threads) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const std::size_t n_features = features.shape(1);
  const std::span<const double> values(features.data(), features.shape(0) * n_features);
  const auto given = view(weights);
  Buffer<double> sums(given.size());
  on_team(arcs.n_cells(), n_threads, [&](ThreadTeam& team) {
    add_feature_steps(arcs, given, values, n_features, factor, team, sums.span());
  });
  return to_numpy(std::move(sums));
}

auto bind_find_components(const Array<std::int64_t>& offsets, const Array<Cell>& neighbors,
                          const Array<Label>& labels) {
  const Arcs arcs{view(offsets), view(neighbors)};
  const auto input = view(labels);
  Components components = without_gil([&] { return find_components(arcs, input); });
  return std::tuple(to_numpy(std::move(components.of)), components.n_components);
}

auto bind_superfacet_weights(const TriangleSurface& surface, const Rows<double>& centroids,
                             const Array<double>& areas, const Rows<double>& normals, double alpha,
                             double eta_convex, double crease_length, double diagonal,
                             double ridges, double evened, bool wants_turn,
                             const Array<std::uint8_t>& is_counted, int n_threads) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const FaceMeasures faces{points(centroids), view(areas), points(normals)};
  const WeightOptions options{alpha, eta_convex, crease_length, diagonal, ridges, evened};
  const NetTurn net_turn(diagonal, view(is_counted));
  const std::int64_t turn = on_team(surface.n_cells(), n_threads, [&](ThreadTeam& team) {
    return superfacet_weights(surface, faces, options, wants_turn ? &net_turn : nullptr, team,
                              weights.span());
  });
  return std::tuple(to_numpy(std::move(weights)), turn);
}

auto bind_stk02_weights(const TriangleSurface& surface, const Rows<double>& centroids, double alpha,
                        int n_threads) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const auto input = points(centroids);
  on_team(surface.n_cells(), n_threads,
          [&](ThreadTeam& team) { stk02_weights(surface, input, alpha, team, weights.span()); });
  return to_numpy(std::move(weights));
}

auto bind_surface_weights(const Surface& surface, double alpha, double eta_convex,
                          double crease_length, double diagonal, double ridges, double evened,
                          bool wants_turn, const Array<std::uint8_t>& is_counted, int n_threads) {
  Buffer<double> weights(surface.arcs().n_arcs());
  const WeightOptions options{alpha, eta_convex, crease_length, diagonal, ridges, evened};
  const NetTurn net_turn(diagonal, view(is_counted));
  const std::int64_t turn = on_team(surface.n_cells(), n_threads, [&](ThreadTeam& team) {
    return surface_weights(surface, options, wants_turn ? &net_turn : nullptr, team,
                           weights.span());
  });
  return std::tuple(to_numpy(std::move(weights)), turn);
}

auto bind_polygon_stk02_weights(const PolygonSurface& surface, double alpha, int n_threads) {
  Buffer<double> weights(surface.arcs().n_arcs());
  on_team(surface.n_cells(), n_threads,
          [&](ThreadTeam& team) { stk02_weights(surface, alpha, team, weights.span()); });
  return to_numpy(std::move(weights));
}

auto bind_quantize_weights(const Array<double>& weights, int n_threads) {
  Buffer<float> lengths(weights.shape(0));
  const auto input = view(weights);
  const double unit = on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    return quantize_weights(input, team, lengths.span());
  });
  return std::tuple(to_numpy(std::move(lengths)), unit);
}

template <typename T>
Buffer<T> copied(std::span<const T> values) {
  Buffer<T> buffer(values.size());
  std::copy(values.begin(), values.end(), buffer.begin());
  return buffer;
}

// Of cells and arcs that are sorted along the curve already.
OrderedGraph graph_in_place(
    std::span<const Point> positions, std::span<const double> measures,
    std::tuple<std::span<const std::int64_t>, std::span<const Place>, std::span<const float>> lists,
    ThreadTeam& team) {
  const auto [offsets, targets, lengths] = lists;
  Buffer<Arc> arcs(targets.size());
  for (std::size_t arc = 0; arc < targets.size(); ++arc) arcs[arc] = {targets[arc], lengths[arc]};
  return {PlacedCells(copied(positions), copied(measures), team), copied(offsets), std::move(arcs)};
}

auto bind_round_weights(const Array<double>& weights, double unit, int n_threads) {
  Buffer<float> lengths(weights.shape(0));
  const auto input = view(weights);
  on_team(input.size(), n_threads,
          [&](ThreadTeam& team) { round_weights(input, unit, team, lengths.span()); });
  return to_numpy(std::move(lengths));
}

auto bind_morton_codes(const Rows<double>& positions, const std::tuple<double, double, double>& low,
                       const std::tuple<double, double, double>& high, int n_threads) {
  const auto input = points(positions);
  const Box bounds{as_point(low), as_point(high)};
  return to_numpy(on_team(input.size(), n_threads,
                          [&](ThreadTeam& team) { return morton_codes(input, bounds, team); }));
}

auto bind_order_within_steps(const Rows<double>& positions, const Array<std::uint32_t>& codes,
                             int n_threads) {
  const auto input = std::pair(points(positions), view(codes));
  return to_numpy(on_team(input.first.size(), n_threads, [&](ThreadTeam& team) {
    return order_within_steps(input.first, input.second, BoxTree::kLeaf, team);
  }));
}

auto bind_nearest_in_part(const Rows<double>& positions, const Array<std::uint8_t>& is_wanted,
                          int n_nearest, int n_threads) {
  const auto input = std::pair(points(positions), view(is_wanted));
  NearestRows found = on_team(input.first.size(), n_threads, [&](ThreadTeam& team) {
    return nearest_in_part(input.first, input.second, static_cast<std::size_t>(n_nearest), team);
  });
  return std::tuple(to_numpy(std::move(found.points)), to_numpy(std::move(found.squared)));
}

auto bind_directions_around(const Rows<double>& positions, const Array<Cell>& centers,
                            const Array<Cell>& rows, int n_threads) {
  const auto input = points(positions);
  const auto around = std::pair(view(centers), view(rows));
  return to_numpy(on_team(around.first.size(), n_threads, [&](ThreadTeam& team) {
    return directions_around(input, around.first, around.second, team);
  }));
}

auto bind_sorted_lists(Cell n_cells, const Array<Cell>& sources, const Array<Place>& targets) {
  const auto pairs = std::pair(view(sources), view(targets));
  SortedLists lists = without_gil([&] { return sorted_lists(n_cells, pairs.first, pairs.second); });
  return std::tuple(to_numpy(std::move(lists.offsets)), to_numpy(std::move(lists.targets)));
}

NormalTile normal_tile(const Table<Place>& rows, const Array<Place>& places,
                       const Array<Cell>& cells, const Rows<double>& normals) {
  return {{{rows.data(), rows.size()}, rows.shape(1)}, view(places), view(cells), points(normals)};
}

void bind_join_alike(TurnedSets& sets, const Table<Place>& rows, const Array<Place>& places,
                     const Array<Cell>& cells, const Rows<double>& normals) {
  const NormalTile tile = normal_tile(rows, places, cells, normals);
  without_gil([&] { join_alike(sets, tile); });
}

// Costs of the pairs, their four numbers in a row, and whether normals are opposite.
auto bind_pairs_apart(TurnedSets& sets, const Table<Place>& rows, const Array<Place>& places,
                      const Array<Cell>& cells, const Rows<double>& normals) {
  const NormalTile tile = normal_tile(rows, places, cells, normals);
  const std::vector<NormalPair> pairs = without_gil([&] { return pairs_apart(sets, tile); });
  std::vector<double> costs;
  std::vector<Cell> numbers;  // the lower, the higher, from and to of each
  std::vector<std::uint8_t> opposite;
  for (const NormalPair& pair : pairs) {
    costs.push_back(pair.cost);
    numbers.insert(numbers.end(), {pair.lower, pair.higher, pair.from, pair.to});
    opposite.push_back(static_cast<std::uint8_t>(pair.is_opposite));
  }
  return std::tuple(to_numpy(std::move(costs)), to_numpy(std::move(numbers)),
                    to_numpy(std::move(opposite)));
}

void bind_unite(TurnedSets& sets, const Array<Place>& from, const Array<Place>& to,
                const Array<std::uint8_t>& is_opposite) {
  const auto pairs = std::tuple(view(from), view(to), view(is_opposite));
  without_gil([&] {
    const auto [starts, ends, opposite] = pairs;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      sets.unite(starts[i], ends[i], opposite[i] != 0);
    }
  });
}

auto bind_roots(TurnedSets& sets, Place begin, Place end) {
  Buffer<Place> roots(end - begin);
  Buffer<std::uint8_t> turned(end - begin);
  without_gil([&] {
    for (Place place = begin; place < end; ++place) {
      const auto [root, is_turned] = sets.root(place);
      roots[place - begin] = root;
      turned[place - begin] = static_cast<std::uint8_t>(is_turned);
    }
  });
  return std::tuple(to_numpy(std::move(roots)), to_numpy(std::move(turned)));
}

OrderedGraph bind_graph_in_place(const Rows<double>& positions, const Array<double>& measures,
                                 const Array<std::int64_t>& offsets, const Array<Place>& targets,
                                 const Array<float>& lengths, int n_threads) {
  const auto cells = std::pair(points(positions), view(measures));
  const auto input = std::tuple(view(offsets), view(targets), view(lengths));
  return on_team(cells.first.size(), n_threads, [&](ThreadTeam& team) {
    return graph_in_place(cells.first, cells.second, input, team);
  });
}

// Calls a search for the cells nearest to queries: both take about a microsecond each.
template <typename Search>
auto on_nearest(std::size_t n_cells, std::size_t n_queries, int n_threads, const Search& search) {
  constexpr std::int64_t kMinPerSearchThread = 1 << 10;
  NearestCells found = on_team(n_cells + n_queries, n_threads, search, kMinPerSearchThread);
  return std::tuple(to_numpy(std::move(found.cells)), to_numpy(std::move(found.distances)),
                    to_numpy(std::move(found.points)));
}

auto bind_nearest_triangles(const Rows<double>& vertices, const Rows<Vertex>& faces,
                            const Rows<double>& queries, double max_distance, int n_threads) {
  const auto mesh = std::pair(points(vertices), triangles(faces));
  const auto from = points(queries);
  return on_nearest(mesh.second.size(), from.size(), n_threads, [&](ThreadTeam& team) {
    return nearest_triangles(mesh.first, mesh.second, from, max_distance, team);
  });
}

auto bind_nearest_tets(const Rows<double>& vertices, const TetRows& tets,
                       const Rows<double>& queries, double max_distance, int n_threads) {
  const auto mesh = std::pair(points(vertices), tet_span(tets));
  const auto from = points(queries);
  return on_nearest(mesh.second.size(), from.size(), n_threads, [&](ThreadTeam& team) {
    return nearest_tets(mesh.first, mesh.second, from, max_distance, team);
  });
}

auto bind_nearest_points(const Rows<double>& positions, const Rows<double>& queries,
                         double max_distance, int n_threads) {
  const auto cloud = points(positions);
  const auto from = points(queries);
  return on_nearest(cloud.size(), from.size(), n_threads, [&](ThreadTeam& team) {
    return nearest_points(cloud, from, max_distance, team);
  });
}

void bind_placed_cells(PlacedCells* self, const Rows<double>& positions,
                       const Array<double>& measures, int n_threads) {
  const auto input = std::pair(points(positions), view(measures));
  on_team(input.first.size(), n_threads, [&](ThreadTeam& team) {
    return new (self) PlacedCells(input.first, input.second, team);
  });
}

void bind_ordered_graph(OrderedGraph* self, PlacedCells& cells, const Array<std::int64_t>& offsets,
                        const Array<Cell>& neighbors, const Array<float>& lengths, int n_threads,
                        bool is_symmetric) {
  const WeightedArcs arcs{{view(offsets), view(neighbors)}, view(lengths), is_symmetric};
  on_team(cells.n_cells(), n_threads,
          [&](ThreadTeam& team) { return new (self) OrderedGraph(std::move(cells), arcs, team); });
}

auto bind_positions_of(const OrderedGraph& graph, const Array<Cell>& cells) {
  std::vector<Point> positions;
  for (const Place place : graph.places_of(view(cells))) {
    positions.push_back(graph.positions[place]);
  }
  return to_numpy(std::move(positions));
}

}  // namespace

void bind_cells(nb::module_& module) {
  nb::class_<Surface>(module, "Surface")
      .def_prop_ro("n_cells", &Surface::n_cells)
      .def("cells", &bind_surface_cells, "n_threads"_a)
      .def("arc_measures", &bind_arc_measures, "n_threads"_a);
  nb::class_<TriangleSurface, Surface>(module, "TriangleSurface")
      .def("__init__", &bind_triangle_surface, "vertices"_a.noconvert(), "faces"_a.noconvert(),
           "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "sides"_a.noconvert(),
           "same_turn"_a.noconvert(), "inside_out"_a, nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
           nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>())
      .def_prop_ro("is_inside_out", &TriangleSurface::is_inside_out);
  nb::class_<PolygonSurface, Surface>(module, "PolygonSurface")
      .def("__init__", &bind_polygon_surface, "vertices"_a.noconvert(),
           "face_offsets"_a.noconvert(), "corners"_a.noconvert(), "offsets"_a.noconvert(),
           "neighbors"_a.noconvert(), "sides"_a.noconvert(), "same_turn"_a.noconvert(),
           "inside_out"_a, "n_threads"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
           nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>())
      .def_prop_ro("is_inside_out", &PolygonSurface::is_inside_out);
  nb::class_<GraphSurface, Surface>(module, "GraphSurface")
      .def("__init__", &bind_graph_surface, "positions"_a.noconvert(), "measures"_a.noconvert(),
           "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "border_lengths"_a.noconvert(),
           "step_lengths"_a.noconvert(), "angles"_a.noconvert(), "sides"_a.noconvert(),
           "open_lengths"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
           nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(), nb::keep_alive<1, 9>(),
           nb::keep_alive<1, 10>());
  nb::class_<TetSurface, GraphSurface>(module, "TetSurface")
      .def("__init__", &bind_tet_surface, "vertices"_a.noconvert(), "tets"_a.noconvert(),
           "positions"_a.noconvert(), "volumes"_a.noconvert(), "offsets"_a.noconvert(),
           "neighbors"_a.noconvert(), "border_areas"_a.noconvert(), "step_lengths"_a.noconvert(),
           "sides"_a.noconvert(), "open_areas"_a.noconvert(), nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(),
           nb::keep_alive<1, 6>(), nb::keep_alive<1, 7>(), nb::keep_alive<1, 8>(),
           nb::keep_alive<1, 9>(), nb::keep_alive<1, 10>(), nb::keep_alive<1, 11>());
  nb::class_<PointSurface, Surface>(module, "PointSurface")
      .def("__init__", &bind_point_surface, "positions"_a.noconvert(), "areas"_a.noconvert(),
           "normals"_a.noconvert(), "order"_a.noconvert(), "offsets"_a.noconvert(),
           "neighbors"_a.noconvert(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           nb::keep_alive<1, 4>(), nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>(),
           nb::keep_alive<1, 7>());
  nb::class_<SubSurface, Surface>(module, "SubSurface")
      .def("__init__", &bind_sub_surface, "whole"_a, "offsets"_a.noconvert(),
           "neighbors"_a.noconvert(), "kept_cells"_a.noconvert(), "kept_arcs"_a.noconvert(),
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
           nb::keep_alive<1, 5>(), nb::keep_alive<1, 6>());
  nb::class_<PlacedCells>(module, "PlacedCells")
      .def("__init__", &bind_placed_cells, "positions"_a.noconvert(), "measures"_a.noconvert(),
           "n_threads"_a);
  nb::class_<OrderedGraph, PlacedCells>(module, "OrderedGraph")
      .def("__init__", &bind_ordered_graph, "cells"_a, "offsets"_a.noconvert(),
           "neighbors"_a.noconvert(), "lengths"_a.noconvert(), "n_threads"_a,
           "is_symmetric"_a = false)
      .def_prop_ro("n_cells", &OrderedGraph::n_cells)
      .def_ro("total_measure", &OrderedGraph::total_measure)
      .def_ro("is_symmetric", &OrderedGraph::is_symmetric)
      .def("order",
           [](const OrderedGraph& graph) {
             return to_numpy(std::vector<Cell>(graph.cells.begin(), graph.cells.end()));
           })
      .def("positions_of", &bind_positions_of, "cells"_a.noconvert());
  module.def("build_face_graph", &bind_build_face_graph, "faces"_a.noconvert(),
             "representative"_a.noconvert(), "n_threads"_a);
  module.def("build_polygon_graph", &bind_build_polygon_graph, "offsets"_a.noconvert(),
             "corners"_a.noconvert(), "representative"_a.noconvert(), "n_threads"_a);
  module.def("build_tet_graph", &bind_build_tet_graph, "vertices"_a.noconvert(),
             "tets"_a.noconvert(), "representative"_a.noconvert(), "n_threads"_a);
  module.def("build_point_graph", &bind_build_point_graph, "positions"_a.noconvert(),
             "n_neighbors"_a, "n_around"_a, "cutoff"_a, "has_normals"_a, "n_threads"_a);
  module.def("build_sorted_point_graph", &bind_build_sorted_point_graph, "positions"_a.noconvert(),
             "n_neighbors"_a, "n_around"_a, "cutoff"_a, "has_normals"_a, "n_threads"_a);
  module.def("point_weights", &bind_point_weights, "surface"_a, "alpha"_a, "eta_convex"_a,
             "crease_length"_a, "diagonal"_a, "n_threads"_a);
  module.def("add_feature_steps", &bind_add_feature_steps, "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "weights"_a.noconvert(), "features"_a.noconvert(),
             "factor"_a, "n_threads"_a);
  module.def("ray_thickness", &bind_ray_thickness, "vertices"_a.noconvert(), "faces"_a.noconvert(),
             "starts"_a.noconvert(), "axes"_a.noconvert(), "n_rays"_a, "least_distance"_a,
             "inside_out"_a, "n_threads"_a);
  module.def("logarithms", &bind_logarithms, "values"_a.noconvert());
  module.def("crease_conductances", &bind_crease_conductances, "surface"_a, "areas"_a.noconvert(),
             "weights"_a.noconvert(), "diagonal"_a, "crease_unit"_a, "steepness"_a, "n_threads"_a);
  module.def("hindered_conductances", &bind_hindered_conductances, "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "conductances"_a.noconvert(), "values"_a.noconvert(),
             "steepness"_a, "n_threads"_a);
  module.def("sum_between", &bind_sum_between, "offsets"_a.noconvert(), "neighbors"_a.noconvert(),
             "conductances"_a.noconvert(), "steps"_a.noconvert(), "coarse_of"_a.noconvert(),
             "coarse_offsets"_a.noconvert(), "coarse_neighbors"_a.noconvert());
  module.def("relax", &bind_relax, "offsets"_a.noconvert(), "neighbors"_a.noconvert(),
             "conductances"_a.noconvert(), "rows"_a.noconvert(), "n_sweeps"_a, "n_threads"_a);
  module.def("diffuse", &bind_diffuse, "offsets"_a.noconvert(), "neighbors"_a.noconvert(),
             "conductances"_a.noconvert(), "masses"_a.noconvert(), "values"_a.noconvert(), "time"_a,
             "n_threads"_a);
  module.def("part_weights", &bind_part_weights, "offsets"_a.noconvert(), "neighbors"_a.noconvert(),
             "weights"_a.noconvert(), "group_of"_a.noconvert(), "vectors"_a.noconvert(),
             "exponents"_a.noconvert(), "factor"_a, "n_threads"_a);
  module.def("smallest_eigenpairs", &bind_smallest_eigenpairs, "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "conductances"_a.noconvert(), "measures"_a.noconvert(),
             "components"_a.noconvert(), "n_components"_a, "n_wanted"_a);
  module.def("find_components", &bind_find_components, "offsets"_a.noconvert(),
             "neighbors"_a.noconvert(), "labels"_a.noconvert());
  module.def("superfacet_weights", &bind_superfacet_weights, "surface"_a, "centroids"_a.noconvert(),
             "areas"_a.noconvert(), "normals"_a.noconvert(), "alpha"_a, "eta_convex"_a,
             "crease_length"_a, "diagonal"_a, "ridges"_a, "evened"_a, "wants_turn"_a,
             "is_counted"_a.noconvert(), "n_threads"_a);
  module.def("stk02_weights", &bind_stk02_weights, "surface"_a, "centroids"_a.noconvert(),
             "alpha"_a, "n_threads"_a);
  module.def("surface_weights", &bind_surface_weights, "surface"_a, "alpha"_a, "eta_convex"_a,
             "crease_length"_a, "diagonal"_a, "ridges"_a, "evened"_a, "wants_turn"_a,
             "is_counted"_a.noconvert(), "n_threads"_a);
  module.def("polygon_stk02_weights", &bind_polygon_stk02_weights, "surface"_a, "alpha"_a,
             "n_threads"_a);
  module.def("quantize_weights", &bind_quantize_weights, "weights"_a.noconvert(), "n_threads"_a);
  module.def("unit_of_lengths", &unit_of_lengths, "total_weight"_a);
  module.def("round_weights", &bind_round_weights, "weights"_a.noconvert(), "unit"_a,
             "n_threads"_a);
  module.def("morton_codes", &bind_morton_codes, "positions"_a.noconvert(), "low"_a, "high"_a,
             "n_threads"_a);
  module.def("order_within_steps", &bind_order_within_steps, "positions"_a.noconvert(),
             "codes"_a.noconvert(), "n_threads"_a);
  module.def("nearest_in_part", &bind_nearest_in_part, "positions"_a.noconvert(),
             "is_wanted"_a.noconvert(), "n_nearest"_a, "n_threads"_a);
  module.def("directions_around", &bind_directions_around, "positions"_a.noconvert(),
             "centers"_a.noconvert(), "rows"_a.noconvert(), "n_threads"_a);
  module.def("sorted_lists", &bind_sorted_lists, "n_cells"_a, "sources"_a.noconvert(),
             "targets"_a.noconvert());
  nb::class_<TurnedSets>(module, "TurnedSets")
      .def(nb::init<Place>(), "n_places"_a)
      .def("join_alike", &bind_join_alike, "rows"_a.noconvert(), "places"_a.noconvert(),
           "cells"_a.noconvert(), "normals"_a.noconvert())
      .def("pairs_apart", &bind_pairs_apart, "rows"_a.noconvert(), "places"_a.noconvert(),
           "cells"_a.noconvert(), "normals"_a.noconvert())
      .def("unite", &bind_unite, "from_places"_a.noconvert(), "to_places"_a.noconvert(),
           "is_opposite"_a.noconvert())
      .def("roots", &bind_roots, "begin"_a, "end"_a);
  module.def("graph_in_place", &bind_graph_in_place, "positions"_a.noconvert(),
             "measures"_a.noconvert(), "offsets"_a.noconvert(), "targets"_a.noconvert(),
             "lengths"_a.noconvert(), "n_threads"_a);
  module.def("sum_of", &bind_sum_of, "values"_a.noconvert(), "n_threads"_a);
  module.def("nearest_triangles", &bind_nearest_triangles, "vertices"_a.noconvert(),
             "faces"_a.noconvert(), "queries"_a.noconvert(), "max_distance"_a, "n_threads"_a);
  module.def("nearest_tets", &bind_nearest_tets, "vertices"_a.noconvert(), "tets"_a.noconvert(),
             "queries"_a.noconvert(), "max_distance"_a, "n_threads"_a);
  module.def("nearest_points", &bind_nearest_points, "positions"_a.noconvert(),
             "queries"_a.noconvert(), "max_distance"_a, "n_threads"_a);
}

}  // namespace superfacets
