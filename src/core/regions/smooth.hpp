// Stage 5: straightens the borders between regions.
#pragma once

#include "cells/surface.hpp"
#include "regions/borders.hpp"
#include "regions/stiffness.hpp"

namespace superfacets {

struct SmoothOptions {
  // maximum path length by which a border moves, in the unit of the positions
  double max_distance = 0.0;
  std::size_t max_chain = 1;  // maximum number of cells in a chain
  int max_sweeps = 1;         // maximum number of passes over the borders
  StiffnessOptions stiff;     // penalty for changes of area and for long regions
};

// Moves chains of cells across borders between regions, while this lowers the sum of border cost
// and stiffness cost.
//
// Regions are grouped in patches (see make_patches), which are processed color by color. Patches of
// one color are processed in parallel. Such patches are independent: no cell that a patch reads or
// moves is adjacent to another patch of its color, and moves that would break this rule are
// forbidden. Within a patch, cells are tried in ascending order. A patch sees its own changes of
// areas and the changes made by earlier colors. The result is the same for any number of threads.
//
// Invariants: Connected cells of a region stay connected. No region loses its last cell. Cells in
// `fixed` do not move. A cell moves to a region only if its travel is at most max_distance. The
// travel is the path length from the initial border of that region, along the cells that moved
// earlier.
//
// Time O(N + M), plus O(max_chain^2) per sweep for each cell that is initially at a border or
// adjacent to a moved cell. Memory: at most 10 bytes per cell and 4 bytes per arc. Of these, 4
// bytes per cell and per arc are used only near borders. Runs on one thread if some arc has no
// reverse arc.
Buffer<Label> smooth_borders(const Surface& surface, const BorderCost& cost,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

struct SmoothedPart {
  Buffer<Label> labels;
  std::vector<Cell> examined;  // rim cells for which a move was considered
};

// Like smooth_borders, for a part of a surface. The part contains all border cells, and cells
// around them up to a rim. A rim cell lacks a neighbor, or a cell at one of its corners. Cells are
// in the order of the whole surface, and `at_first` holds the sums over regions of the whole
// surface. The kernel reads only the labels of cells that it does not examine. If no rim cell was
// examined, the result therefore equals the result on the whole surface.
SmoothedPart smooth_part(const Surface& surface, const BorderCost& cost,
                         std::span<const Label> labels, std::span<const Cell> fixed,
                         std::span<const Cell> rim, const RegionSums& at_first,
                         const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
