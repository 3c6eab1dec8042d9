// Bindings of stage 5. The functions are documented in the headers of regions/. Their preconditions
// are checked by superfacets/base/checks.py.
#include "bindings/bindings.hpp"
#include "regions/bridges.hpp"
#include "regions/cut_borders.hpp"
#include "regions/graph_segments.hpp"
#include "regions/join.hpp"
#include "regions/lines.hpp"
#include "regions/merge_tree.hpp"
#include "regions/region_graph.hpp"
#include "regions/region_sizes.hpp"
#include "regions/share_vertices.hpp"
#include "regions/shared_masks.hpp"
#include "regions/smooth.hpp"
#include "regions/vertex_labels.hpp"

namespace superfacets {
namespace {

// These objects refer to the memory of Python arrays, which def_view keeps alive.
void make_border_costs(BorderCosts* self, Floats lengths, double unit, double crease_scale) {
  new (self) BorderCosts{lengths, unit, crease_scale};
}

void make_smooth_options(SmoothOptions* self, double max_distance, std::size_t max_chain,
                         int max_sweeps, double stiffness, double roundness, Doubles sizes,
                         Doubles goals) {
  new (self)
      SmoothOptions{{max_distance, max_chain}, max_sweeps, {stiffness, roundness, sizes, goals}};
}

auto borders_between(const Surface& surface, const BorderCosts& costs, Integers labels,
                     ThreadTeam& team) {
  return columns(region_borders(surface, costs, labels, team), &RegionBorder::low,
                 &RegionBorder::high, &RegionBorder::cost);
}

auto joined_regions(const Surface& surface, const BorderCosts& costs, Integers labels,
                    Doubles areas, Bytes stays, double least_area, ThreadTeam& team) {
  return join_regions(areas, region_borders(surface, costs, labels, team), {stays, least_area});
}

auto region_shapes(const Surface& surface, Integers labels, Label n_regions, ThreadTeam& team) {
  using Shape = RegionShape;
  return columns(measure_regions(surface, labels, n_regions, team), &Shape::measure,
                 &Shape::centroid, &Shape::squares, &Shape::products, &Shape::normal_sum,
                 &Shape::low, &Shape::high, &Shape::open_length, &Shape::center);
}

auto arcs_between(const Surface& surface, Integers labels, ThreadTeam& team) {
  return columns(region_arcs(surface, labels, team), &RegionArc::low, &RegionArc::high,
                 &RegionArc::border_length, &RegionArc::mean_angle, &RegionArc::signed_angle,
                 &RegionArc::max_angle, &RegionArc::n_sides);
}

auto bridges_between(const PlacedCells& cells, Integers ranks, Cell n_components) {
  return columns(find_bridges(cells, ranks, n_components), &Bridge::from, &Bridge::to);
}

MergeTree tree_of_merges(Doubles areas, Points positions, Doubles features, Integers low,
                         Integers high, Doubles lengths, Doubles costs, double crease_weight,
                         int dimension) {
  std::vector<MergeBorder> borders;
  borders.reserve(low.size());
  for (std::size_t i = 0; i < low.size(); ++i) {
    borders.push_back({low[i], high[i], lengths[i], costs[i]});
  }
  return merge_tree({areas, positions, features, borders}, {crease_weight, dimension});
}

Buffer<Label> moved_cells(const Surface& surface, const BorderCosts& costs, Integers labels,
                          Doubles sizes, Doubles lows, Doubles highs, bool may_split,
                          ThreadTeam& team) {
  return move_cells(surface, costs, labels, {sizes, lows, highs, may_split}, team);
}

auto cut_through_faces(Points vertices, Triangles faces, Integers representative, Integers labels,
                       Label n_labels, Bytes is_kept, int n_rounds, int n_steps, int n_balances,
                       double margin, ThreadTeam& team) {
  return cut_borders({vertices, faces, representative, labels, is_kept, n_labels},
                     {n_rounds, n_steps, n_balances, margin}, team);
}

Buffer<Cell> segments_of_graph(Points positions, Points normals, Integers ends, double threshold,
                               std::int64_t least, ThreadTeam& team) {
  return graph_segments(positions, normals, ends, {threshold, least}, team);
}

Buffer<Label> labels_spread(Offsets offsets, Integers neighbors, Points positions, Points normals,
                            Integers labels, Integers hints, Offsets allowed, Label n_labels) {
  return spread_labels({offsets, neighbors, positions, normals}, labels, hints,
                       {allowed, n_labels});
}

Buffer<Label> vertices_shared(Integers vertices, Integers labels, Integers winners, Label n_labels,
                              ThreadTeam& team) {
  return share_vertices({vertices, labels, n_labels}, winners, team);
}

Buffer<Label> small_regions_grown(Offsets offsets, Integers neighbors, Points positions,
                                  Points normals, Integers labels, Integers counts, Label n_labels,
                                  std::int64_t least) {
  return grow_small_regions({offsets, neighbors, positions, normals}, labels,
                            {counts, n_labels, least});
}

Buffer<Label> small_regions_merged(Offsets offsets, Integers neighbors, Points positions,
                                   Points normals, Integers labels, Integers counts, Label n_labels,
                                   std::int64_t least) {
  return merge_small_regions({offsets, neighbors, positions, normals}, labels,
                             {counts, n_labels, least});
}

Buffer<Label> joined_by_masks(Offsets offsets, Integers masks, Doubles areas, Integers image_of,
                              double least) {
  return join_by_masks({offsets, masks, areas, image_of}, least);
}

}  // namespace

void bind_regions(nb::module_& module) {
  nb::class_<BorderCosts> costs(module, "BorderCosts");
  def_view(costs, &make_border_costs, "lengths"_a, "unit"_a, "crease_scale"_a);
  nb::class_<SmoothOptions> options(module, "SmoothOptions");
  def_view(options, &make_smooth_options, "max_distance"_a, "max_chain"_a, "max_sweeps"_a,
           "stiffness"_a, "roundness"_a, "sizes"_a, "goals"_a);
  module.def("region_borders", threaded(&borders_between), "surface"_a, "costs"_a, "labels"_a,
             "n_threads"_a);
  module.def("join_regions", threaded(&joined_regions), "surface"_a, "costs"_a, "labels"_a,
             "areas"_a, "stays"_a, "least_area"_a, "n_threads"_a);
  module.def("region_perimeters", threaded(&region_perimeters), "surface"_a, "labels"_a,
             "n_regions"_a, "n_threads"_a);
  module.def("measure_regions", threaded(&region_shapes), "surface"_a, "labels"_a, "n_regions"_a,
             "n_threads"_a);
  module.def("region_arcs", threaded(&arcs_between), "surface"_a, "labels"_a, "n_threads"_a);
  module.def("trace_lines", serial(&trace_lines), "partners"_a);
  module.def("smooth_borders", threaded(&smooth_borders), "surface"_a, "costs"_a, "labels"_a,
             "fixed"_a, "options"_a, "n_threads"_a);
  module.def("move_cells", threaded(&moved_cells), "surface"_a, "costs"_a, "labels"_a, "sizes"_a,
             "lows"_a, "highs"_a, "may_split"_a, "n_threads"_a);
  module.def("cut_borders", threaded(&cut_through_faces), "vertices"_a, "faces"_a,
             "representative"_a, "labels"_a, "n_labels"_a, "is_kept"_a, "n_rounds"_a, "n_steps"_a,
             "n_balances"_a, "margin"_a, "n_threads"_a);
  module.def("graph_segments", threaded(&segments_of_graph), "positions"_a, "normals"_a, "ends"_a,
             "threshold"_a, "least"_a, "n_threads"_a);
  module.def("spread_labels", serial(&labels_spread), "offsets"_a, "neighbors"_a, "positions"_a,
             "normals"_a, "labels"_a, "hints"_a, "allowed"_a, "n_labels"_a);
  module.def("share_vertices", threaded(&vertices_shared), "vertices"_a, "labels"_a, "winners"_a,
             "n_labels"_a, "n_threads"_a);
  module.def("grow_small_regions", serial(&small_regions_grown), "offsets"_a, "neighbors"_a,
             "positions"_a, "normals"_a, "labels"_a, "counts"_a, "n_labels"_a, "least"_a);
  module.def("merge_small_regions", serial(&small_regions_merged), "offsets"_a, "neighbors"_a,
             "positions"_a, "normals"_a, "labels"_a, "counts"_a, "n_labels"_a, "least"_a);
  module.def("find_bridges", serial(&bridges_between), "cells"_a, "ranks"_a, "n_components"_a);
  module.def("join_by_masks", serial(&joined_by_masks), "offsets"_a, "masks"_a, "areas"_a,
             "image_of"_a, "least"_a);
  module.def("merge_tree", serial(&tree_of_merges), "areas"_a, "positions"_a, "features"_a, "low"_a,
             "high"_a, "lengths"_a, "costs"_a, "crease_weight"_a, "dimension"_a);
}

}  // namespace superfacets
