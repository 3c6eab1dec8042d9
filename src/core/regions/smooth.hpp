// Stage 5: smooths the borders between regions.
#pragma once

#include "regions/chains.hpp"

namespace superfacets {

struct SmoothOptions {
  ChainOptions chains;
  int max_sweeps = 1;      // maximum number of passes over the borders
  StiffnessOptions stiff;  // penalty for changes of area and for long regions
};

// Moves chains of cells across borders between regions, as long as this decreases the sum of border
// costs (see BorderCosts) and stiffness costs (see StiffnessOptions).
//
// Regions are grouped in patches (see make_patches), which are processed color by color, in
// parallel for all patches of one color. Patches of one color are independent, because they are
// never adjacent: moves that would make two of them adjacent are not allowed. Within a patch, cells
// are tried in ascending order. The costs of a move depend on area changes within the patch and in
// patches of earlier colors, but not in other patches of the same color. So the result is the same
// for any number of threads.
//
// Invariants: Connected cells of a region stay connected. No region loses its last cell. Cells in
// `fixed` do not move. A border moves by at most max_distance, which is measured as the path length
// from the initial border along the cells that moved.
//
// Time O(N + M), plus O(max_chain^2) per sweep for each cell that is initially at a border or
// adjacent to a moved cell. Uses at most 10 bytes per cell and 4 bytes per arc; most of this memory
// is only touched near borders. Runs on one thread if some arc has no reverse arc.
Buffer<Label> smooth_borders(const Surface& surface, const BorderCosts& costs,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
