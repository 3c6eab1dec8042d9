// Lengths of shortest paths from some cells to all cells, or between nearby cells, for normalized
// cuts. No other functions need memory quadratic in the number of cells.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Rows of a sparse matrix, in CSR form.
struct SparseRows {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> columns;          // (E,) ascending within a row
  Buffer<float> values;          // (E,)
};

// Row i holds the length of the shortest path from sources[i] to each cell, multiplied by `unit`,
// or infinity if there is no path. Time O(S (N + M)) in practice; memory 4 bytes per source and
// cell.
Buffer<float> path_lengths(const OrderedGraph& graph, std::span<const Cell> sources, double unit,
                           ThreadTeam& team);

// Path lengths from each cell to itself (0) and to all cells within the Euclidean distance `reach`.
// A path is the shortest path whose places, except the last, are all within reach of the source.
// This bound depends on the source, so the two paths between a pair of cells may differ, or only
// one may exist. Memory: 8 bytes per pair, 16 while rows are concatenated.
SparseRows path_lengths_within(const OrderedGraph& graph, double reach, double unit,
                               ThreadTeam& team);

}  // namespace superfacets
