#include "clustering/coarse_sums.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/assert.hpp"
#include "base/exponential.hpp"
#include "spectral/diffusion.hpp"

namespace superfacets {
namespace {

// The index of the arc from one coarse cell to another.
std::int64_t arc_between(const OrderedGraph& graph, Cell from, Cell to) {
  const auto arcs = graph.arcs_of(from);  // sorted by target
  const auto at = std::lower_bound(arcs.begin(), arcs.end(), to,
                                   [](const Arc& arc, Cell target) { return arc.to < target; });
  SUPERFACETS_ASSERT(at != arcs.end() && at->to == to);
  return graph.offsets[from] + (at - arcs.begin());
}

// Conductance times step.
double flow_of(const OrderedGraph& fine, std::span<const double> areas,
               const CrossingOptions& options, Place from, const Arc& arc) {
  const double step = norm(fine.positions[arc.to] - fine.positions[from]);
  const double crease = std::max(0.0, options.unit * arc.length - step);
  const double kappa = options.crease_unit > 0.0 ? crease / options.crease_unit : 0.0;
  const double width = std::sqrt(areas[fine.cells[from]] + areas[fine.cells[arc.to]]);
  return width * exponential(-options.steepness * kappa) + kLeastConductance * step;
}

}  // namespace

Buffer<double> crossing_conductances(const CoarseGraph& coarse, std::span<const double> areas,
                                     const CrossingOptions& options, ThreadTeam& team) {
  const OrderedGraph& fine = coarse.fine();
  SUPERFACETS_ASSERT(std::cmp_equal(areas.size(), fine.n_cells()));
  Buffer<double> sums(coarse.graph().n_arcs);
  team.fill(sums.span(), 0.0);
  // Both sums of a pair are updated at the lower coarse cell, so that one thread does it.
  team.for_each(coarse.n_ranges(), [&](std::int64_t range, int) {
    const auto [begin, end] = coarse.places(range);
    for (Place place = begin; place < end; ++place) {
      const Cell from = coarse.coarse_of(place);
      for (const Arc& arc : fine.arcs_of(place)) {
        const Cell to = coarse.coarse_of(arc.to);
        if (to <= from) continue;
        const double flow = flow_of(fine, areas, options, place, arc);
        sums[arc_between(coarse.graph(), from, to)] += flow;
        sums[arc_between(coarse.graph(), to, from)] += flow;
      }
    }
  });
  return sums;
}

Buffer<double> coarse_steps(const CoarseGraph& coarse, ThreadTeam& team) {
  constexpr double kLeastShare = 0.2;
  const OrderedGraph& graph = coarse.graph();
  Buffer<double> steps(graph.n_arcs);
  team.for_each_index(graph.n_cells(), [&](Cell cell) {
    std::int64_t next = graph.offsets[cell];
    for (const Arc& arc : graph.arcs_of(cell)) {
      const double width = std::sqrt(graph.measures[cell] + graph.measures[arc.to]);
      const double way = norm(graph.positions[arc.to] - graph.positions[cell]);
      const double step = std::max(way, kLeastShare * width);
      steps[next++] = step > 0.0 ? step : 1.0;
    }
  });
  return steps;
}

}  // namespace superfacets
