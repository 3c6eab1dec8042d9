// What coarse cells take over from the surface below them, summed over their cells.
#pragma once

#include <algorithm>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "clustering/coarsening.hpp"

namespace superfacets {

struct CrossingOptions {
  double unit = 1.0;  // of the lengths of fine arcs, in that of the positions
  double crease_unit = 1.0;
  double steepness = 20.0;
};

// Of arcs between coarse cells: the sum of conductance times step over all fine arcs that lead from
// one to the other, by the formula of CreaseConductance but for the step: that is the straight way,
// which is at hand. Where fine cells are small beside regions, the difference adds less than a
// thousandth to kappa. `areas` are by fine cell. Symmetric, bit for bit.
Buffer<double> crossing_conductances(const CoarseGraph& coarse, std::span<const double> areas,
                                     const CrossingOptions& options, ThreadTeam& team);

// How far the middles of coarse cells at the ends of each arc are apart. Cells on both sides of a
// rim may have one middle: at least a share of their width, and never 0.
Buffer<double> coarse_steps(const CoarseGraph& coarse, ThreadTeam& team);

// The sum of vector_of(cell) over the fine cells in each coarse cell, called from any thread.
template <typename VectorOf>
Buffer<Point> coarse_sums(const CoarseGraph& coarse, const VectorOf& vector_of, ThreadTeam& team) {
  const OrderedGraph& fine = coarse.fine();
  Buffer<Point> sums(coarse.graph().n_cells());
  team.for_each(coarse.n_ranges(), [&](std::int64_t range, int) {
    const auto [begin, end] = coarse.places(range);
    const auto [first, last] = coarse.cells_of(range);
    std::fill(sums.begin() + first, sums.begin() + last, Point{0.0, 0.0, 0.0});
    for (Place place = begin; place < end; ++place) {
      Point& sum = sums[coarse.coarse_of(place)];
      sum = sum + vector_of(fine.cells[place]);
    }
  });
  return sums;
}

}  // namespace superfacets
