#include "clustering/coarse_sums.hpp"

#include <algorithm>

#include "base/assert.hpp"

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

}  // namespace

Buffer<double> crossing_conductances(const CoarseGraph& coarse, const CreaseConductance& formula,
                                     ThreadTeam& team) {
  const OrderedGraph& fine = coarse.fine();
  const Arcs& arcs = formula.surface.arcs();
  SUPERFACETS_ASSERT(arcs.n_cells() == fine.n_cells());
  Buffer<double> sums(coarse.graph().n_arcs);
  team.fill(sums.span(), 0.0);
  // Both sums of a pair are added to where the lower coarse cell is: on one thread.
  team.for_each(coarse.n_ranges(), [&](std::int64_t range, int) {
    const auto [begin, end] = coarse.places(range);
    for (Place place = begin; place < end; ++place) {
      const Cell cell = fine.cells[place];
      const Cell from = coarse.coarse_of(place);
      for (const Step arc : arcs.steps(cell)) {
        const Cell to = coarse.coarse_of(fine.place_of[arc.to]);
        if (to <= from) continue;
        const auto [step, conductance] = formula.of(cell, arc);
        const double product = conductance * step;
        sums[arc_between(coarse.graph(), from, to)] += product;
        sums[arc_between(coarse.graph(), to, from)] += product;
      }
    }
  });
  return sums;
}

Buffer<Point> coarse_sums(const CoarseGraph& coarse, std::span<const Point> vectors,
                          ThreadTeam& team) {
  const OrderedGraph& fine = coarse.fine();
  SUPERFACETS_ASSERT(std::cmp_equal(vectors.size(), fine.n_cells()));
  Buffer<Point> sums(coarse.graph().n_cells());
  team.for_each(coarse.n_ranges(), [&](std::int64_t range, int) {
    const auto [begin, end] = coarse.places(range);
    const auto [first, last] = coarse.cells_of(range);
    std::fill(sums.begin() + first, sums.begin() + last, Point{0.0, 0.0, 0.0});
    for (Place place = begin; place < end; ++place) {
      Point& sum = sums[coarse.coarse_of(place)];
      sum = sum + vectors[fine.cells[place]];
    }
  });
  return sums;
}

}  // namespace superfacets
