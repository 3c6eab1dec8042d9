// Normals of points that agree with each other.
#pragma once

#include "base/types.hpp"

namespace superfacets {

inline constexpr Place kNoPlace = -1;

// The nearest neighbors of each place; rows of the same length, which kNoPlace fills up.
struct NeighborRows {
  std::span<const Place> places;  // (N * n_columns,)
  std::size_t n_columns;

  std::span<const Place> row(Place place) const {
    return places.subspan(n_columns * place, n_columns);
  }
};

// Turns normals over so that those of neighbors agree: along a minimum spanning tree of each
// component of the neighbors, by 1 - |n_i . n_j| (Hoppe et al. 1992), where pairs that differ by
// less than ten degrees count as equal. Then all normals of a component are turned over if they
// enclose a negative volume. `points` are the places' numbers in the input, which decide ties.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals);

}  // namespace superfacets
