// Stage 2: far arcs, which join cells that are two or three arcs apart.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Default value of most_steps in add_far_arcs.
inline constexpr int kFarSteps = 3;

// Replaces the arcs of the graph by arcs between all cells that are at most n steps apart, so that
// a cell has about 20 arcs. A step follows one old arc. n is 3 if a cell has at most 3.5 arcs on
// average, as in a triangle mesh, and 2 if it has at most 8, but never more than most_steps. If
// cells have more arcs, the graph is not changed. The length of a new arc is the straight distance
// between its cells, plus the lowest total crease cost of a walk of at most n steps.
//
// Without far arcs, shortest paths depend on the pattern of the cells: on a regular grid, regions
// stretch along the diagonals of the grid. With far arcs, cells at equal distance have paths of
// about equal length in all directions.
//
// The graph must be symmetric and have a straight_unit > 0 (see OrderedGraph). Time O(N + M) if
// cells have few arcs.
void add_far_arcs(OrderedGraph& graph, int most_steps, ThreadTeam& team);

}  // namespace superfacets
