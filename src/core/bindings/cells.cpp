// Bindings of stages 1 and 2: graphs of cells, surfaces, weights of arcs, and colors of textures.
// The functions are documented in the headers of cells/. Their preconditions are checked by
// superfacets/base/checks.py.

#include <numeric>

#include "bindings/bindings.hpp"
#include "cells/components.hpp"
#include "cells/far_arcs.hpp"
#include "cells/graph_surface.hpp"
#include "cells/majority.hpp"
#include "cells/part_costs.hpp"
#include "cells/point_graph.hpp"
#include "cells/point_surface.hpp"
#include "cells/polygon_graph.hpp"
#include "cells/polygon_surface.hpp"
#include "cells/quantization.hpp"
#include "cells/sub_surface.hpp"
#include "cells/surface_weights.hpp"
#include "cells/tet_graph.hpp"
#include "cells/texels.hpp"
#include "cells/triangle_graph.hpp"
#include "cells/turning.hpp"
#include "cells/walk.hpp"

namespace superfacets {
namespace {

// Surfaces refer to the memory of Python arrays, which def_view keeps alive.
void make_triangle_surface(TriangleSurface* self, Points vertices, Triangles faces, Offsets offsets,
                           Integers neighbors, Bytes sides, Bytes same_turn, bool inside_out) {
  new (self) TriangleSurface(vertices, faces, {offsets, neighbors}, sides, same_turn, inside_out);
}

void make_polygon_surface(PolygonSurface* self, Points vertices, Offsets face_offsets,
                          Integers corners, Offsets offsets, Integers neighbors, Integers sides,
                          Bytes same_turn, bool inside_out, int n_threads) {
  on_team(face_offsets.size(), n_threads, [&](ThreadTeam& team) {
    new (self) PolygonSurface(vertices, {face_offsets, corners}, {offsets, neighbors}, sides,
                              same_turn, inside_out, team);
  });
}

void make_graph_surface(GraphSurface* self, Points positions, Doubles measures, Offsets offsets,
                        Integers neighbors, Doubles border_lengths, Doubles step_lengths,
                        Doubles angles, Integers sides, Doubles open_lengths) {
  new (self) GraphSurface({offsets, neighbors}, {positions, measures, border_lengths, step_lengths,
                                                 angles, sides, open_lengths});
}

void make_tet_surface(TetSurface* self, Points vertices, Tets tets, Points positions,
                      Doubles volumes, Offsets offsets, Integers neighbors, Doubles border_areas,
                      Doubles step_lengths, Integers sides, Doubles open_areas) {
  new (self) TetSurface(vertices, tets, {offsets, neighbors},
                        {positions, volumes, border_areas, step_lengths, {}, sides, open_areas});
}

void make_point_surface(PointSurface* self, Points positions, Doubles areas, Points normals,
                        Integers order, Offsets offsets, Integers neighbors) {
  new (self) PointSurface(positions, areas, normals, order, {offsets, neighbors});
}

void make_sub_surface(SubSurface* self, const Surface& whole, Offsets offsets, Integers neighbors,
                      Integers kept_cells, Offsets kept_arcs) {
  new (self) SubSurface(whole, {offsets, neighbors}, {kept_cells, kept_arcs});
}

auto cells_of(const Surface& surface, ThreadTeam& team) {
  Buffer<Point> positions(surface.n_cells());
  Buffer<double> measures(surface.n_cells());
  team.for_each_index(surface.n_cells(), [&](Cell cell) {
    positions[cell] = surface.position(cell);
    measures[cell] = surface.measure(cell);
  });
  return std::tuple(std::move(positions), std::move(measures));
}

auto arc_measures(const Surface& surface, ThreadTeam& team) {
  Buffer<double> border_lengths(surface.arcs().n_arcs());
  Buffer<double> step_lengths(surface.arcs().n_arcs());
  Buffer<double> angles(surface.arcs().n_arcs());
  Buffer<std::int32_t> sides(surface.arcs().n_arcs());
  Buffer<double> open_lengths(surface.n_cells());
  team.for_each_index(surface.n_cells(), [&](Cell cell) {
    open_lengths[cell] = surface.open_length(cell);
    for (const auto [arc, neighbor] : surface.arcs().steps(cell)) {
      border_lengths[arc] = surface.border_length(cell, arc);
      step_lengths[arc] = surface.step_length(cell, arc);
      angles[arc] = surface.angle(cell, arc);
      sides[arc] = surface.side(cell, arc);
    }
  });
  return std::tuple(std::move(border_lengths), std::move(step_lengths), std::move(angles),
                    std::move(sides), std::move(open_lengths));
}

void make_placed_cells(PlacedCells* self, Points positions, Doubles measures, int n_threads,
                       bool is_sorted) {
  on_team(positions.size(), n_threads,
          [&](ThreadTeam& team) { new (self) PlacedCells(positions, measures, is_sorted, team); });
}

// Measures of the cells in the order of the input. The graph stores them in its sorted order.
std::vector<double> measures_of(const OrderedGraph& graph) {
  std::vector<double> measures(graph.n_cells());
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    measures[cell] = graph.measures[graph.place_of(cell)];
  }
  return measures;
}

// The graph may refer to `lengths`. An attribute keeps them alive until they are replaced.
constexpr const char* kKept = "_lengths";

void make_ordered_graph(nb::pointer_and_handle<OrderedGraph> self, PlacedCells& cells,
                        Offsets offsets, Integers neighbors, const nb::object& lengths,
                        int n_threads, bool is_symmetric, double straight_unit, bool are_shared) {
  const WeightedArcs arcs{
      {offsets, neighbors}, nb::cast<Floats>(lengths), is_symmetric, straight_unit, are_shared};
  on_team(cells.n_cells(), n_threads,
          [&](ThreadTeam& team) { new (self.p) OrderedGraph(std::move(cells), arcs, team); });
  if (are_shared) nb::setattr(self.h, kKept, lengths);
}

void set_lengths_of(nb::handle self, Offsets offsets, Integers neighbors, const nb::object& lengths,
                    int n_threads) {
  auto& graph = nb::cast<OrderedGraph&>(self);
  const WeightedArcs arcs{{offsets, neighbors}, nb::cast<Floats>(lengths)};
  on_team(graph.n_cells(), n_threads, [&](ThreadTeam& team) { graph.set_lengths(arcs, team); });
  if (graph.shares_arcs()) nb::setattr(self, kKept, lengths);
}

auto positions_of(const OrderedGraph& graph, Integers cells) {
  std::vector<Point> positions;
  for (const Place place : graph.places_of(cells)) positions.push_back(graph.positions[place]);
  return positions;
}

PolygonGraph polygon_graph(Offsets offsets, Integers corners, Integers representative,
                           ThreadTeam& team) {
  return build_polygon_graph({offsets, corners}, representative, team);
}

std::tuple<TetGraph, TetMeasures> tet_graph(Points vertices, Tets tets, Integers representative,
                                            ThreadTeam& team) {
  TetGraph graph = build_tet_graph(tets, representative, team);
  TetMeasures measures = measure_tets(vertices, tets, graph, team);
  return {std::move(graph), std::move(measures)};
}

// If `sorted` is true, cells are points sorted along the space-filling curve. If `sorted` is false,
// cells are in the order of the input, and PointGraph::points contains the order of the points
// along the curve.
PointGraph point_graph(Points positions, std::size_t n_neighbors, std::size_t n_around,
                       double cutoff, bool has_normals, Points axes, bool sorted,
                       ThreadTeam& team) {
  PointGraph found =
      build_point_graph(positions, {n_neighbors, n_around, cutoff, has_normals, axes}, team);
  if (sorted) return found;
  PointGraph graph = in_input_order(found, team);
  graph.points = std::move(found.points);
  return graph;
}

void add_far_arcs_to(OrderedGraph& graph, int n_threads, int most_steps) {
  const auto work = [&](ThreadTeam& team) { add_far_arcs(graph, most_steps, team); };
  on_team(graph.n_cells(), n_threads, work, kMinSlowPerThread);
}

void add_costs_to(OrderedGraph& graph, Integers group_of, const Table<float>& vectors,
                  double factor, ThreadTeam& team) {
  graph.add_part_costs({vectors.shape(1), values_of(vectors), group_of}, factor, team);
}

Components components(Offsets offsets, Integers neighbors, Integers labels, ThreadTeam& team) {
  return find_components(Arcs{offsets, neighbors}, labels, team);
}

Buffer<Cell> walked(Offsets offsets, Integers neighbors, Integers labels, Label n_regions,
                    ThreadTeam& team) {
  return walk_regions({offsets, neighbors}, labels, n_regions, team);
}

WeighedArcs weights_of_triangles(const TriangleSurface& surface, Points centroids, Doubles areas,
                                 const EdgeFactors& factors, bool wants_sums, ThreadTeam& team) {
  return triangle_weights(surface, {centroids, areas}, factors, wants_sums, team);
}

Buffer<float> with_part_costs(Offsets offsets, Integers neighbors, Floats lengths,
                              Integers group_of, const Table<float>& vectors, double factor,
                              ThreadTeam& team) {
  return add_part_costs({offsets, neighbors}, lengths,
                        {vectors.shape(1), values_of(vectors), group_of}, factor, team);
}

void add_group_costs_to(Offsets offsets, Integers neighbors, const WritableArray<float>& lengths,
                        Integers group_of, Offsets group_offsets, Integers group_neighbors,
                        Floats costs, ThreadTeam& team) {
  add_group_costs({offsets, neighbors}, {lengths.data(), lengths.size()},
                  {{group_offsets, group_neighbors}, costs, group_of}, team);
}

Buffer<double> with_feature_steps(Offsets offsets, Integers neighbors, Doubles weights,
                                  const Table<double>& features, double factor, ThreadTeam& team) {
  return add_feature_steps({offsets, neighbors}, weights, values_of(features), features.shape(1),
                           factor, team);
}

TexelGrid grid_of(std::int64_t width, std::int64_t height, int wrap_u, int wrap_v) {
  return {width, height, static_cast<Wrap>(wrap_u), static_cast<Wrap>(wrap_v)};
}

TexelColors colors_of_texels(Bytes pixels, std::int64_t width, std::int64_t height, int wrap_u,
                             int wrap_v, Integers linear, Doubles coordinates, Integers corners,
                             ThreadTeam& team) {
  const TexelGrid grid = grid_of(width, height, wrap_u, wrap_v);
  return texel_colors(pixels, grid, linear, {coordinates, corners}, team);
}

Buffer<std::int32_t> painted_ids(std::int64_t width, std::int64_t height, int wrap_u, int wrap_v,
                                 Doubles coordinates, Integers corners, Integers ids, int bleed,
                                 ThreadTeam& team) {
  const TexelGrid grid = grid_of(width, height, wrap_u, wrap_v);
  return paint_ids(grid, {coordinates, corners}, ids, bleed, team);
}

void bind_surfaces(nb::module_& module) {
  nb::class_<Surface>(module, "Surface")
      .def_prop_ro("n_cells", &Surface::n_cells)
      .def("cells", threaded(&cells_of), "n_threads"_a)
      .def("arc_measures", threaded(&arc_measures), "n_threads"_a);
  nb::class_<TriangleSurface, Surface> triangles(module, "TriangleSurface");
  def_view(triangles, &make_triangle_surface, "vertices"_a, "faces"_a, "offsets"_a, "neighbors"_a,
           "sides"_a, "same_turn"_a, "inside_out"_a);
  triangles.def_prop_ro("is_inside_out", &TriangleSurface::is_inside_out);
  nb::class_<PolygonSurface, Surface> polygons(module, "PolygonSurface");
  def_view(polygons, &make_polygon_surface, "vertices"_a, "face_offsets"_a, "corners"_a,
           "offsets"_a, "neighbors"_a, "sides"_a, "same_turn"_a, "inside_out"_a, "n_threads"_a);
  polygons.def_prop_ro("is_inside_out", &PolygonSurface::is_inside_out);
  nb::class_<GraphSurface, Surface> graphs(module, "GraphSurface");
  def_view(graphs, &make_graph_surface, "positions"_a, "measures"_a, "offsets"_a, "neighbors"_a,
           "border_lengths"_a, "step_lengths"_a, "angles"_a, "sides"_a, "open_lengths"_a);
  nb::class_<TetSurface, GraphSurface> tets(module, "TetSurface");
  def_view(tets, &make_tet_surface, "vertices"_a, "tets"_a, "positions"_a, "volumes"_a, "offsets"_a,
           "neighbors"_a, "border_areas"_a, "step_lengths"_a, "sides"_a, "open_areas"_a);
  nb::class_<PointSurface, Surface> points(module, "PointSurface");
  def_view(points, &make_point_surface, "positions"_a, "areas"_a, "normals"_a, "order"_a,
           "offsets"_a, "neighbors"_a);
  nb::class_<SubSurface, Surface> parts(module, "SubSurface");
  def_view(parts, &make_sub_surface, "whole"_a, "offsets"_a, "neighbors"_a, "kept_cells"_a,
           "kept_arcs"_a);
}

void bind_graphs(nb::module_& module) {
  nb::class_<PlacedCells> placed(module, "PlacedCells");
  def_view(placed, &make_placed_cells, "positions"_a, "measures"_a, "n_threads"_a,
           "is_sorted"_a = false);
  nb::class_<OrderedGraph, PlacedCells>(module, "OrderedGraph", nb::dynamic_attr())
      .def("__init__", &make_ordered_graph, "cells"_a, "offsets"_a, "neighbors"_a, "lengths"_a,
           "n_threads"_a, "is_symmetric"_a = false, "straight_unit"_a = 0.0, "are_shared"_a = false,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
           "Build a graph from sorted cells. The arrays of `cells` are moved, so `cells` is empty "
           "afterwards. If `are_shared`, the graph refers to the arrays of arcs.")
      .def("set_lengths", &set_lengths_of, "offsets"_a, "neighbors"_a, "lengths"_a, "n_threads"_a)
      .def_prop_ro("n_cells", &OrderedGraph::n_cells)
      .def_ro("is_symmetric", &OrderedGraph::is_symmetric)
      .def_ro("straight_unit", &OrderedGraph::straight_unit)
      .def_rw("crease_limit", &OrderedGraph::crease_limit)
      .def("add_part_costs", threaded<kMinSlowPerThread>(&add_costs_to), "group_of"_a,
           "vectors"_a.noconvert(), "factor"_a, "n_threads"_a)
      .def("add_far_arcs", &add_far_arcs_to, "n_threads"_a, "most_steps"_a = kFarSteps)
      .def("measures", serial(&measures_of))
      .def("order", serial([](const OrderedGraph& graph) {
             std::vector<Place> places(graph.n_cells());
             std::iota(places.begin(), places.end(), 0);
             return graph.cells_at(places);
           }))
      .def("positions_of", serial(&positions_of), "cells"_a);
  module.def("build_triangle_graph", threaded(&build_triangle_graph), "faces"_a, "representative"_a,
             "n_threads"_a);
  module.def("build_polygon_graph", threaded(&polygon_graph), "offsets"_a, "corners"_a,
             "representative"_a, "n_threads"_a);
  module.def("build_tet_graph", threaded(&tet_graph), "vertices"_a, "tets"_a, "representative"_a,
             "n_threads"_a);
  module.def("build_point_graph", threaded(&point_graph), "positions"_a, "n_neighbors"_a,
             "n_around"_a, "cutoff"_a, "has_normals"_a, "axes"_a, "sorted"_a, "n_threads"_a);
  module.def("weighted_majority", serial(&weighted_majority), "groups"_a, "labels"_a, "weights"_a,
             "n_groups"_a);
  module.def("find_components", threaded(&components), "offsets"_a, "neighbors"_a, "labels"_a,
             "n_threads"_a = 1);
  module.def("walk_regions", threaded(&walked), "offsets"_a, "neighbors"_a, "labels"_a,
             "n_regions"_a, "n_threads"_a);
}

void bind_weights(nb::module_& module) {
  nb::class_<EdgeFactors>(module, "EdgeFactors")
      .def(nb::init<double, double, double, double, double, double, bool, double, double>(),
           nb::kw_only(), "alpha"_a, "eta_convex"_a, "crease_length"_a, "diagonal"_a, "ridges"_a,
           "convex_share"_a, "is_straight"_a, "slack"_a, "unit_factor"_a);
  module.def("triangle_weights", threaded(&weights_of_triangles), "surface"_a, "centroids"_a,
             "areas"_a, "factors"_a, "wants_sums"_a, "n_threads"_a);
  module.def("share_of_flat_sides", threaded(&share_of_flat_sides), "surface"_a, "areas"_a,
             "normals"_a, "n_threads"_a);
  module.def("surface_weights", threaded(&surface_weights), "surface"_a, "factors"_a,
             "wants_sums"_a, "n_threads"_a);
  module.def("point_weights", threaded(&point_weights), "surface"_a, "factors"_a, "n_threads"_a);
  module.def("add_feature_steps", threaded(&with_feature_steps), "offsets"_a, "neighbors"_a,
             "weights"_a, "features"_a.noconvert(), "factor"_a, "n_threads"_a);
  module.def("add_part_costs", threaded(&with_part_costs), "offsets"_a, "neighbors"_a, "lengths"_a,
             "group_of"_a, "vectors"_a.noconvert(), "factor"_a, "n_threads"_a);
  module.def("add_group_costs", threaded(&add_group_costs_to), "offsets"_a, "neighbors"_a,
             "lengths"_a.noconvert(), "group_of"_a, "group_offsets"_a, "group_neighbors"_a,
             "costs"_a, "n_threads"_a);
  module.def("quantize_weights", threaded(&quantize_weights), "weights"_a, "n_threads"_a);
  module.def("unit_of_lengths", &unit_of_lengths, "total_weight"_a);
  module.def("round_weights", threaded(&round_weights), "weights"_a, "unit"_a, "n_threads"_a);
  module.def("texel_colors", threaded(&colors_of_texels), "pixels"_a, "width"_a, "height"_a,
             "wrap_u"_a, "wrap_v"_a, "linear"_a, "coordinates"_a, "corners"_a, "n_threads"_a);
  module.def("paint_ids", threaded(&painted_ids), "width"_a, "height"_a, "wrap_u"_a, "wrap_v"_a,
             "coordinates"_a, "corners"_a, "ids"_a, "bleed"_a, "n_threads"_a);
}

}  // namespace

void bind_cells(nb::module_& module) {
  bind_surfaces(module);
  bind_graphs(module);
  bind_weights(module);
}

}  // namespace superfacets
