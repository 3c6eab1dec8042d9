// Stage 2: arcs between cells that are a few steps apart.
#pragma once

#include "base/threads.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// Default of most_steps.
inline constexpr int kFarSteps = 3;

// Adds arcs between cells that are a few arcs apart, so that a cell has about 20 arcs: up to three
// arcs apart if cells have about three arcs each, up to two if they have at most eight; with more
// arcs nothing is added. Cells are at most most_steps arcs apart. An added arc is as long as the
// straight line between its cells, plus the lowest price of a walk of so many arcs.
//
// Shortest paths over shared borders alone depend on the pattern of the cells: on a regular grid,
// regions lean along its diagonals. With the added arcs, paths of equal distance have about equal
// length in all directions.
//
// The graph must be symmetric, with straight steps. Time O(N + M) where cells have few arcs.
void add_far_arcs(OrderedGraph& graph, int most_steps, ThreadTeam& team);

}  // namespace superfacets
