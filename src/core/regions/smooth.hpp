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
// Regions are grouped in patches (see make_patches), and these move their cells color by color,
// the patches of one color side by side: no cell that one of them reads or moves is next to another
// one, and no cell may move to where that would change. Within a patch cells are tried in ascending
// order. The result is the same for any number of threads.
//
// Invariants: connected cells of a region stay connected, no region loses its last cell, cells in
// `fixed` stay, and a cell moves only to a region whose first border is within max_distance, on a
// path along the cells that moved before it.
//
// Time O(N + M) and, for each sweep, O(max_chain^2) per cell at a border, at first, or next to what
// has just moved; memory at most 10 bytes per cell and 4 per arc, of which 4 and
// 4 are touched near borders only. Where not every arc has one back, one thread moves all cells.
Buffer<Label> smooth_borders(const Surface& surface, const BorderCost& cost,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

struct SmoothedPart {
  Buffer<Label> labels;
  std::vector<Cell> examined;  // those of the rim for which a move was considered
};

// The same for a part of a surface that has all cells at borders, and around them others up to a
// rim: cells that lack a neighbor, or a cell at one of their corners. Cells are in the order of the
// whole surface. What is read of cells that are no candidates for a move is their label alone, so
// if no cell of the rim was examined, the result is that of the whole surface.
SmoothedPart smooth_part(const Surface& surface, const BorderCost& cost,
                         std::span<const Label> labels, std::span<const Cell> fixed,
                         std::span<const Cell> rim, const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
