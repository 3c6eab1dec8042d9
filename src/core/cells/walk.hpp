// Orders the cells of each region along the surface.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Lists the cells of region 0, then the cells of region 1, and so on. Cells without a label are
// left out. Within a region, cells are in the order of a walk. The walk begins at the cell with the
// fewest neighbors in the region. The walk continues to the neighbor with the fewest unvisited
// neighbors, so that narrow ends are visited early. At a dead end, the walk backtracks to the last
// cell with an unvisited neighbor. Further connected components of the region follow. If several
// cells qualify, the lowest is chosen. Time O(n log n) for a region of n cells, if cells have few
// neighbors.
Buffer<Cell> walk_regions(const Arcs& arcs, std::span<const Label> labels, Label n_regions,
                          ThreadTeam& team);

}  // namespace superfacets
