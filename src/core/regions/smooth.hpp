// Stage 5: straight borders between regions.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"
#include "regions/borders.hpp"

namespace superfacets {

struct SmoothOptions {
  double max_distance = 0.0;  // that borders may move: a path length, in the positions' unit
  std::size_t max_chain = 1;  // the most cells that move at once
  int max_sweeps = 1;         // the most passes over the borders
};

// Moves cells at borders between regions, as chains of neighbors from one region to another, as
// long as that makes the borders cheaper.
//
// Invariants: connected cells of a region stay connected, no region loses its last cell, cells in
// `fixed` stay, and a cell moves only to a region whose first border is within max_distance, on a
// path along the cells that moved before it.
//
// Time O(N + M) and, for each sweep, O(max_chain^2) per cell at a border or next to what has just
// moved; memory about 10 bytes per cell and 4 per arc. Borders are found on several threads and
// moved on one: the result depends on nothing but the input.
Buffer<Label> smooth_borders(const Surface& surface, const BorderCost& cost,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
