// Stage 1 for clouds, in parts: what is worked out of some points, and of others around them.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// The nearest neighbors of some points: rows of equal length, nearest first.
struct NearestRows {
  Buffer<Cell> points;     // (n * n_nearest,) filled up with -1
  Buffer<double> squared;  // distances; filled up with infinity
};

// Of those of the points that are wanted, in their order, the nearest of all; among equals those of
// the lowest indices. All have different positions.
NearestRows nearest_in_part(std::span<const Point> positions,
                            std::span<const std::uint8_t> is_wanted, std::size_t n_nearest,
                            ThreadTeam& team);

// The direction in which points vary least, of either sign, for each center and its row of
// neighbors, up to the first -1; both are indices.
Buffer<Point> directions_around(std::span<const Point> positions, std::span<const Cell> centers,
                                std::span<const Cell> rows, ThreadTeam& team);

// Lists of what each of n cells is joined with, from pairs in any order: ascending, each once.
struct SortedLists {
  Buffer<std::int64_t> offsets;  // (n + 1,)
  Buffer<Place> targets;
};
SortedLists sorted_lists(Cell n_cells, std::span<const Cell> sources,
                         std::span<const Place> targets);

}  // namespace superfacets
