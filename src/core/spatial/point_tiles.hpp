// Stage 1 for parts of a cloud: computes results for the points of a part from these points and
// their surroundings.
#pragma once

#include "base/lists.hpp"

namespace superfacets {

// The nearest neighbors of several points: rows of equal length, nearest first.
struct NearestRows {
  Buffer<Cell> points;     // (n * n_nearest,) padded with -1
  Buffer<double> squared;  // squared distances, padded with infinity
};

// Finds the n_nearest neighbors among all points of each wanted point, in the order of the wanted
// points. Among equal distances, the lower index comes first. All points have different positions.
NearestRows nearest_in_part(std::span<const Point> positions,
                            std::span<const std::uint8_t> is_wanted, std::size_t n_nearest,
                            ThreadTeam& team);

// For each center, the normal of the center and its neighbors by NormalFit, with arbitrary sign.
// `centers` and `rows` are indices of points. There is one row of neighbors per center, which ends
// at the first -1.
Buffer<Point> directions_around(std::span<const Point> positions, std::span<const Point> axes,
                                std::span<const Cell> centers, std::span<const Cell> rows,
                                ThreadTeam& team);

// Converts pairs (sources[i], targets[i]), in any order, to the list of targets of each of n cells,
// ascending and without duplicates.
Lists<Place> sorted_lists(Cell n_cells, std::span<const Cell> sources,
                          std::span<const Place> targets);

}  // namespace superfacets
