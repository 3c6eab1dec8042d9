// Stage 5: sizes of regions within bounds, by cells that move on along paths of regions.
#pragma once

#include <span>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"
#include "regions/borders.hpp"

namespace superfacets {

// A region is as large as its cells together.
struct SizeBounds {
  std::span<const double> sizes;  // (N,) of the cells, >= 0
  std::span<const double> lows;   // (K,) of the regions
  std::span<const double> highs;  // (K,) at least the lows
  bool may_split = false;         // regions may fall apart where there is no other way
};

// Moves cells from regions above their bound, along shortest paths of neighboring regions, to those
// with room; likewise to regions below their bound from those that can spare cells. From a region
// to the next on a path, the cells move whose borders get cheapest, the lowest among equals.
//
// A cell leaves a region only if that stays connected: by the local test at first, by an exact one
// where that finds no way, and, if regions may split, without a test at last. No region loses its
// last cell. Cells only move across arcs. Regions stay out of bounds where no way is found; if they
// may split, all sizes are 1, and the lows equal the highs and sum up to the number of cells of
// each component, none does.
//
// Serial. Time O(N + M), and for each cell that moves time linear in the size of its region.
Buffer<Label> move_cells(const Surface& surface, const BorderCost& cost,
                         std::span<const Label> labels, const SizeBounds& bounds, ThreadTeam& team);

}  // namespace superfacets
