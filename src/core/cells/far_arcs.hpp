// Stage 2: arcs between cells that are a few steps apart.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Default of most_steps.
inline constexpr int kFarSteps = 3;

// Adds arcs between cells that are a few arcs apart, so that a cell has about 20 arcs. If cells
// have about three arcs each, the added arcs join cells up to three arcs apart. If cells have at
// most eight arcs, the limit is two. With more arcs nothing is added. The length of an added arc is
// the distance between its cells, plus the lowest price of a walk within this limit. Cells at
// the ends of an added arc are at most most_steps arcs apart.
//
// Without added arcs, shortest paths depend on the pattern of the cells: on a regular grid, regions
// stretch along its diagonals. With added arcs, cells at equal distance have paths of about equal
// length in all directions.
//
// The graph must be symmetric, with straight steps. Time O(N + M) where cells have few arcs.
void add_far_arcs(OrderedGraph& graph, int most_steps, ThreadTeam& team);

}  // namespace superfacets
