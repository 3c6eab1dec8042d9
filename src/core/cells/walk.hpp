// The cells of each region in an order along the surface.
#pragma once

#include <span>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// The cells with a label, those of label 0 first, then those of label 1, ...; each region in the
// order of a walk. It begins at the cell with the fewest neighbors in the region, and goes on to
// the neighbor with the fewest neighbors that were not visited, so that narrow ends are not left
// behind. From a dead end it goes back along its way to the last cell with a neighbor to visit;
// other pieces of a region follow. The lowest cells win ties. Time is linear in the cells, and up
// to cubic in the number of neighbors of a cell, which is small.
Buffer<Cell> walk_regions(const Arcs& arcs, std::span<const Label> labels, Label n_regions,
                          ThreadTeam& team);

}  // namespace superfacets
