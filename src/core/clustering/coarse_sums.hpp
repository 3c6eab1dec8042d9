// Sums over the fine cells of coarse cells: conductances, steps and area vectors.
#pragma once

#include <algorithm>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "clustering/coarsening.hpp"

namespace superfacets {

struct CrossingOptions {
  double unit = 1.0;  // length of a unit of fine arc lengths, in the unit of the positions
  double crease_unit = 1.0;
  double steepness = 20.0;
};

// For arcs between coarse cells: the sum of conductance times step over all fine arcs from one to
// the other. The formula is that of CreaseConductance, but the step is the straight distance
// between the positions of fine cells, which needs no mesh. If fine cells are small compared with
// regions, that changes kappa by less than a thousandth. `areas` are by fine cell. Symmetric, bit
// for bit.
Buffer<double> crossing_conductances(const CoarseGraph& coarse, std::span<const double> areas,
                                     const CrossingOptions& options, ThreadTeam& team);

// The distance between the centers of gravity of the coarse cells at the ends of each arc. Cells on
// both sides of a rim may share one: the distance is at least a fraction of their width, and never
// 0.
Buffer<double> coarse_steps(const CoarseGraph& coarse, ThreadTeam& team);

// The sum of vector_of(cell) over the fine cells in each coarse cell; vector_of is called on any
// thread.
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
