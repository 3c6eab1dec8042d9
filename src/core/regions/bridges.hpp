// Stage 5: joins connected components by their nearest cells.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// The nearest pair of cells of a component and of any component of lower rank.
struct Bridge {
  Cell from = 0;
  Cell to = 0;
  double squared_length = kInfinity;
};

// Returns one bridge for each component except rank 0, in the order of ranks. Distances are
// Euclidean. Ties go to the lowest cell of the component, then to the lowest other cell. The
// bridges together connect the graph. `ranks` holds the component rank of each cell. Every rank
// from 0 to n_components - 1 occurs.
//
// Time O(N log N) in practice, because boxes farther away than the shortest bridge so far are
// skipped.
std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components);

}  // namespace superfacets
