// Stage 5: the nearest cells of components across gaps.
#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// The nearest pair of cells that joins a component to a component of lower rank.
struct Bridge {
  Cell from = 0;
  Cell to = 0;
  double squared_length = kInfinity;
};

// Returns one bridge for each component except rank 0, in the order of ranks: the Euclidean nearest
// pair of a cell of the component and a cell of any component of lower rank. Ties go to the lowest
// cell of the component, then to the lowest other cell. The bridges together connect the graph.
// `ranks` holds the component rank of each cell; every rank from 0 to n_components - 1 occurs.
//
// O(N log N) in practice: boxes farther away than the shortest bridge so far are skipped.
std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components);

}  // namespace superfacets
