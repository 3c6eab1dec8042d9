// Stage 5: straight borders between regions.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"
#include "regions/borders.hpp"
#include "regions/stiffness.hpp"

namespace superfacets {

struct SmoothOptions {
  double max_distance = 0.0;  // largest move of a border: a path length, in the positions' unit
  std::size_t max_chain = 1;  // most cells that move together
  int max_sweeps = 1;         // most passes over the borders
  StiffnessOptions stiff;     // how firmly regions keep area and place
};

// Moves chains of cells at borders between regions, as long as that lowers the cost of borders plus
// that of Stiffness.
//
// Regions are grouped in patches (see make_patches), which are processed color by color. Patches of
// one color move their cells in parallel: no cell that one of them reads or moves is adjacent to
// another of that color, and moves that would change that are forbidden. Within a patch, cells are
// tried in ascending order. A patch knows its own changes of areas, and those of all patches of
// earlier colors. The result is the same for any number of threads.
//
// Invariants: connected cells of a region stay connected, no region loses its last cell, cells in
// `fixed` stay, and a cell moves only to a region whose first border is within max_distance, on a
// path along the cells that moved before it.
//
// Time O(N + M), plus O(max_chain^2) in each sweep for each cell that is at a border at first, or
// next to a moved cell; memory at most 10 bytes per cell and 4 per arc, of which 4 and 4 are
// touched near borders only. One thread moves all cells if some arc has no reverse arc.
Buffer<Label> smooth_borders(const Surface& surface, const BorderCost& cost,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

struct SmoothedPart {
  Buffer<Label> labels;
  std::vector<Cell> examined;  // rim cells for which a move was considered
};

// The same for a part of a surface that has all cells at borders, surrounded by further cells up to
// a rim: cells that lack a neighbor, or a cell at one of their corners. Cells are in the order of
// the whole surface, whose regions have the sums `at_first`. Of cells that are not considered for a
// move, only the label is read: if no rim cell was examined, the result is that of the whole
// surface.
SmoothedPart smooth_part(const Surface& surface, const BorderCost& cost,
                         std::span<const Label> labels, std::span<const Cell> fixed,
                         std::span<const Cell> rim, const RegionSums& at_first,
                         const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
