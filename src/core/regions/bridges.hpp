// Stage 5: the nearest cells of components across gaps.
#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// The nearest pair of cells between a component and those of lower rank.
struct Bridge {
  Cell from = 0;
  Cell to = 0;
  double squared_length = kInfinity;
};

// For each component but rank 0, in the order of ranks, the nearest (Euclidean) pair of a cell of
// its own and a cell of any component of lower rank; of equal pairs the one with the lowest own
// cell, then with the lowest other cell. All bridges together connect the graph. `ranks` are by
// cell, 0 to n_components - 1, each at least once.
//
// O(N log N) in practice: boxes farther away than the shortest bridge so far are skipped.
std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components);

}  // namespace superfacets
