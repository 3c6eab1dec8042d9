// Stage 5: moves cells between regions until the size of each region is within given bounds.
#pragma once

#include "regions/borders.hpp"

namespace superfacets {

// The size of a region is the sum of the sizes of its cells.
struct SizeBounds {
  std::span<const double> sizes;  // (N,) size of each cell, >= 0
  std::span<const double> lows;   // (K,) lower bound of the size of each region
  std::span<const double> highs;  // (K,) upper bound of the size of each region, >= lows
  bool may_split = false;         // whether regions may become disconnected as a last resort
};

// Moves cells from regions above their upper bound to regions with room, and from regions with
// spare cells to regions below their lower bound. Cells move along shortest paths in the region
// graph: each region of a path passes cells to the next region. Cells move in descending order of
// the decrease of the border cost, then in ascending order of their index.
//
// A cell leaves a region only if the region stays connected. This is first checked with a fast
// local test, which may fail for regions that stay connected. If no path remains, an exact test is
// used. If may_split is true, cells are finally moved without a test. No region loses its last
// cell, and cells only move across arcs. If no path is found, a region stays out of bounds. A path
// always exists if regions may split, all cells have size 1, and lows and highs are equal and sum
// to the number of cells in each connected component.
//
// Runs on one thread. Time O(N + M), plus O(number of cells of its region) for each cell that
// moves.
Buffer<Label> move_cells(const Surface& surface, const BorderCosts& costs,
                         std::span<const Label> labels, const SizeBounds& bounds, ThreadTeam& team);

}  // namespace superfacets
