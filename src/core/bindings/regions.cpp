// Bindings of stage 5. The headers of the stage describe the functions; superfacets/_validate.py
// ensures their preconditions.
#include "bindings/bindings.hpp"
#include "regions/borders.hpp"
#include "regions/bridges.hpp"
#include "regions/join.hpp"
#include "regions/lines.hpp"
#include "regions/merge_tree.hpp"
#include "regions/region_graph.hpp"
#include "regions/rings.hpp"
#include "regions/smooth.hpp"

namespace superfacets {
namespace {

auto bind_region_borders(const Surface& surface, const Array<float>& lengths, double unit,
                         double crease_scale, const Array<Label>& labels, int n_threads) {
  const BorderCost cost{view(lengths), unit, crease_scale};
  const auto regions = view(labels);
  const std::vector<RegionBorder> borders =
      on_team(regions.size(), n_threads,
              [&](ThreadTeam& team) { return region_borders(surface, cost, regions, team); });
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

auto bind_region_perimeters(const Surface& surface, const Array<Label>& labels, Label n_regions,
                            int n_threads) {
  const auto regions = view(labels);
  return to_numpy(on_team(regions.size(), n_threads, [&](ThreadTeam& team) {
    return region_perimeters(surface, regions, n_regions, team);
  }));
}

auto bind_measure_regions(const Surface& surface, const Array<Label>& labels, Label n_regions,
                          int n_threads) {
  const auto input = view(labels);
  RegionShapes shapes = on_team(input.size(), n_threads, [&](ThreadTeam& team) {
    return measure_regions(surface, input, n_regions, team);
  });
  return std::tuple(to_numpy(std::move(shapes.measures)), to_numpy(std::move(shapes.centroids)),
                    to_numpy(std::move(shapes.squares)), to_numpy(std::move(shapes.products)),
                    to_numpy(std::move(shapes.normal_sums)), to_numpy(std::move(shapes.lows)),
                    to_numpy(std::move(shapes.highs)), to_numpy(std::move(shapes.open_lengths)),
                    to_numpy(std::move(shapes.centers)));
}

template <typename T, typename Number>
auto column(const std::vector<RegionArc>& arcs, Number RegionArc::* member) {
  std::vector<T> values;
  values.reserve(arcs.size());
  for (const RegionArc& arc : arcs) values.push_back(arc.*member);
  return to_numpy(std::move(values));
}

auto bind_region_arcs(const Surface& surface, const Array<Label>& labels, int n_threads) {
  const auto input = view(labels);
  const std::vector<RegionArc> arcs = on_team(
      input.size(), n_threads, [&](ThreadTeam& team) { return region_arcs(surface, input, team); });
  return std::tuple(
      column<Label>(arcs, &RegionArc::low), column<Label>(arcs, &RegionArc::high),
      column<double>(arcs, &RegionArc::border_length), column<double>(arcs, &RegionArc::mean_angle),
      column<double>(arcs, &RegionArc::signed_angle), column<double>(arcs, &RegionArc::max_angle),
      column<std::int64_t>(arcs, &RegionArc::n_sides));
}

auto bind_trace_lines(const Array<std::int64_t>& partners) {
  const auto input = view(partners);
  Lines lines = without_gil([&] { return trace_lines(input); });
  return std::tuple(to_numpy(std::move(lines.offsets)), to_numpy(std::move(lines.entries)),
                    to_numpy(std::move(lines.are_closed)));
}

auto bind_join_regions(const Surface& surface, const Array<float>& lengths, double unit,
                       double crease_scale, const Array<Label>& labels, const Array<double>& areas,
                       const Array<std::uint8_t>& stays, double least_area, int n_threads) {
  const BorderCost cost{view(lengths), unit, crease_scale};
  const auto input = std::pair(view(labels), view(areas));
  const JoinRule rule{view(stays), least_area};
  return to_numpy(on_team(input.first.size(), n_threads, [&](ThreadTeam& team) {
    return join_regions(input.second, region_borders(surface, cost, input.first, team), rule);
  }));
}

auto bind_find_bridges(const PlacedCells& cells, const Array<Cell>& ranks, Cell n_components) {
  const auto input = view(ranks);
  const std::vector<Bridge> bridges =
      without_gil([&] { return find_bridges(cells, input, n_components); });
  std::vector<Cell> from;
  std::vector<Cell> to;
  for (const Bridge& bridge : bridges) {
    from.push_back(bridge.from);
    to.push_back(bridge.to);
  }
  return std::tuple(to_numpy(std::move(from)), to_numpy(std::move(to)));
}

auto bind_merge_tree(const Array<double>& areas, const Rows<double>& positions,
                     const Array<double>& features, const Array<Label>& low,
                     const Array<Label>& high, const Array<double>& lengths,
                     const Array<double>& costs, double crease_weight, int dimension) {
  std::vector<MergeBorder> borders;
  borders.reserve(low.shape(0));
  for (std::size_t i = 0; i < low.shape(0); ++i) {
    borders.push_back({view(low)[i], view(high)[i], view(lengths)[i], view(costs)[i]});
  }
  const MergeRegions regions{view(areas), points(positions), view(features), borders};
  const MergeRule rule{crease_weight, dimension};
  MergeTree tree = without_gil([&] { return merge_tree(regions, rule); });
  return std::tuple(to_numpy(std::move(tree.children)), to_numpy(std::move(tree.costs)));
}

auto bind_smooth_borders(const Surface& surface, const Array<float>& lengths, double unit,
                         double crease_scale, const Array<Label>& labels, const Array<Cell>& fixed,
                         double max_distance, std::size_t max_chain, int max_sweeps,
                         int n_threads) {
  const BorderCost cost{view(lengths), unit, crease_scale};
  const SmoothOptions options{max_distance, max_chain, max_sweeps};
  const auto input = std::pair(view(labels), view(fixed));
  return to_numpy(on_team(input.first.size(), n_threads, [&](ThreadTeam& team) {
    return smooth_borders(surface, cost, input.first, input.second, options, team);
  }));
}

auto bind_smooth_part(const Surface& surface, const Array<float>& lengths, double unit,
                      double crease_scale, const Array<Label>& labels, const Array<Cell>& fixed,
                      double max_distance, std::size_t max_chain, int max_sweeps, int n_threads,
                      const Array<Cell>& rim) {
  const BorderCost cost{view(lengths), unit, crease_scale};
  const SmoothOptions options{max_distance, max_chain, max_sweeps};
  const auto input = std::tuple(view(labels), view(fixed), view(rim));
  SmoothedPart part = on_team(labels.shape(0), n_threads, [&](ThreadTeam& team) {
    const auto [by_cell, staying, watched] = input;
    return smooth_part(surface, cost, by_cell, staying, watched, options, team);
  });
  return std::tuple(to_numpy(std::move(part.labels)), to_numpy(std::move(part.examined)));
}

auto bind_cells_at_borders(const Array<std::int64_t>& offsets, const Array<Cell>& targets,
                           const Array<Label>& labels) {
  const auto input = std::tuple(view(offsets), view(targets), view(labels));
  return to_numpy(without_gil([&] { return std::apply(cells_at_borders, input); }));
}

// Returns new numbers; those given stay as they are.
auto bind_spread_rings(const Array<std::int64_t>& offsets, const Array<Vertex>& corners,
                       const Array<std::uint8_t>& rings) {
  const CellCorners cells{view(offsets), view(corners)};
  Buffer<std::uint8_t> spread(rings.shape(0));
  std::copy_n(rings.data(), rings.shape(0), spread.data());
  without_gil([&] { spread_rings(cells, spread.span()); });
  return to_numpy(std::move(spread));
}

auto bind_cut_band(const Array<std::int64_t>& offsets, const Array<Vertex>& corners,
                   const Array<std::uint8_t>& rings, const Array<std::int64_t>& arc_offsets,
                   const Array<std::int32_t>& sides) {
  const CellCorners cells{view(offsets), view(corners)};
  const auto input = std::tuple(view(rings), view(arc_offsets), view(sides));
  BandOfTile band = without_gil([&] {
    const auto [marks, arcs, left_by] = input;
    return cut_band(cells, marks, arcs, left_by);
  });
  return std::tuple(to_numpy(std::move(band.cells)), to_numpy(std::move(band.rim)),
                    to_numpy(std::move(band.corner_counts)), to_numpy(std::move(band.corners)),
                    to_numpy(std::move(band.vertices)), to_numpy(std::move(band.arc_counts)),
                    to_numpy(std::move(band.arcs)));
}

}  // namespace

void bind_regions(nb::module_& module) {
  module.def("region_borders", &bind_region_borders, "surface"_a, "lengths"_a.noconvert(), "unit"_a,
             "crease_scale"_a, "labels"_a.noconvert(), "n_threads"_a);
  module.def("join_regions", &bind_join_regions, "surface"_a, "lengths"_a.noconvert(), "unit"_a,
             "crease_scale"_a, "labels"_a.noconvert(), "areas"_a.noconvert(), "stays"_a.noconvert(),
             "least_area"_a, "n_threads"_a);
  module.def("region_perimeters", &bind_region_perimeters, "surface"_a, "labels"_a.noconvert(),
             "n_regions"_a, "n_threads"_a);
  module.def("measure_regions", &bind_measure_regions, "surface"_a, "labels"_a.noconvert(),
             "n_regions"_a, "n_threads"_a);
  module.def("region_arcs", &bind_region_arcs, "surface"_a, "labels"_a.noconvert(), "n_threads"_a);
  module.def("cells_at_borders", &bind_cells_at_borders, "offsets"_a.noconvert(),
             "targets"_a.noconvert(), "labels"_a.noconvert());
  module.def("spread_rings", &bind_spread_rings, "offsets"_a.noconvert(), "corners"_a.noconvert(),
             "rings"_a.noconvert());
  module.def("cut_band", &bind_cut_band, "offsets"_a.noconvert(), "corners"_a.noconvert(),
             "rings"_a.noconvert(), "arc_offsets"_a.noconvert(), "sides"_a.noconvert());
  module.def("trace_lines", &bind_trace_lines, "partners"_a.noconvert());
  module.def("smooth_borders", &bind_smooth_borders, "surface"_a, "lengths"_a.noconvert(), "unit"_a,
             "crease_scale"_a, "labels"_a.noconvert(), "fixed"_a.noconvert(), "max_distance"_a,
             "max_chain"_a, "max_sweeps"_a, "n_threads"_a);
  module.def("smooth_part", &bind_smooth_part, "surface"_a, "lengths"_a.noconvert(), "unit"_a,
             "crease_scale"_a, "labels"_a.noconvert(), "fixed"_a.noconvert(), "max_distance"_a,
             "max_chain"_a, "max_sweeps"_a, "n_threads"_a, "rim"_a.noconvert());
  module.def("find_bridges", &bind_find_bridges, "cells"_a, "ranks"_a.noconvert(),
             "n_components"_a);
  module.def("merge_tree", &bind_merge_tree, "areas"_a.noconvert(), "positions"_a.noconvert(),
             "features"_a.noconvert(), "low"_a.noconvert(), "high"_a.noconvert(),
             "lengths"_a.noconvert(), "costs"_a.noconvert(), "crease_weight"_a, "dimension"_a);
}

}  // namespace superfacets
