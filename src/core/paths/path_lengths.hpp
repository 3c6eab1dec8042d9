// Matrix of shortest path lengths between nearby cells, as needed for normalized cuts.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Rows of a sparse matrix, in CSR form.
struct SparseRows {
  Buffer<std::int64_t> offsets;  // (N + 1,) start of each row
  Buffer<Cell> columns;          // (E,) column of each entry, ascending within a row
  Buffer<float> values;          // (E,) value of each entry
};

// Returns the path lengths from each cell to itself (0) and to all cells within the Euclidean
// distance `reach`, multiplied by `unit`. Paths may only pass through cells within `reach` of their
// source. So the paths from a to b and from b to a may have different lengths, or only one of them
// may exist. Uses 8 bytes per pair of cells, and 16 while rows are concatenated.
SparseRows path_lengths_within(const OrderedGraph& graph, double reach, double unit,
                               ThreadTeam& team);

}  // namespace superfacets
