// Stage 1 for clouds, in parts: results for some points, computed from these and points around
// them.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// The nearest neighbors of several points: rows of equal length, nearest first.
struct NearestRows {
  Buffer<Cell> points;     // (n * n_nearest,) padded with -1
  Buffer<double> squared;  // distances, padded with infinity
};

// For the wanted points, in their order, the nearest of all points; the lowest indices win ties.
// All points have different positions.
NearestRows nearest_in_part(std::span<const Point> positions,
                            std::span<const std::uint8_t> is_wanted, std::size_t n_nearest,
                            ThreadTeam& team);

// The direction of least variance, of either sign, for each center and its row of neighbors, up to
// the first -1; both are indices.
Buffer<Point> directions_around(std::span<const Point> positions, std::span<const Cell> centers,
                                std::span<const Cell> rows, ThreadTeam& team);

// Neighbors of each of n cells, from pairs in any order: ascending, without duplicates.
struct SortedLists {
  Buffer<std::int64_t> offsets;  // (n + 1,)
  Buffer<Place> targets;
};
SortedLists sorted_lists(Cell n_cells, std::span<const Cell> sources,
                         std::span<const Place> targets);

}  // namespace superfacets
