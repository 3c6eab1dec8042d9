// Stage 5: which cells face each other across the gaps between components.
#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// The shortest step from a component to one of lower rank.
struct Bridge {
  Cell from = 0;
  Cell to = 0;
  double squared_length = kInfinity;
};

// For each component but that of rank 0, in the order of ranks, the nearest (Euclidean) two cells
// of which one is its own and the other is of any component of lower rank; of equal pairs that with
// the lowest cell of its own, then that with the lowest other. All bridges together make the cells
// one component. `ranks` are by cell, 0 to n_components - 1, each at least once.
//
// O(N log N) in practice: boxes farther away than the shortest step so far are skipped.
std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components);

}  // namespace superfacets
