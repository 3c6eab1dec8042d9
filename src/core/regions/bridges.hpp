// Stage 5: finds pairs of near cells that join the connected components of a graph.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// The nearest pair of cells between a component and any component with a lower rank.
struct Bridge {
  double squared_length = kInfinity;
  Cell from = 0;  // cell of the component
  Cell to = 0;    // cell of a component with a lower rank

  auto operator<=>(const Bridge&) const = default;  // by length, then by `from`, then by `to`
};

// Returns one bridge for each component except the component with rank 0, in the order of ranks.
// Together, the bridges connect the graph. Distances are Euclidean. Equal distances are ordered by
// `from`, then by `to`. `ranks` contains the rank of each cell's component. Every rank from 0 to
// n_components - 1 must occur.
//
// Time O(N log N) in practice, because boxes farther away than the shortest bridge so far are
// skipped.
std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components);

}  // namespace superfacets
