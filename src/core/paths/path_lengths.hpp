// Lengths of shortest paths between cells: from some cells to all, or between nearby cells. Used by
// normalized cuts. Only these functions need memory quadratic in the number of cells.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// Rows of a sparse matrix, in CSR form.
struct SparseRows {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> columns;          // (E,) ascending within a row
  Buffer<float> values;          // (E,)
};

// Row i holds the length of the shortest path from sources[i] to each cell, in units times `unit`;
// infinity where there is none. Time O(S (N + M)) in practice; memory 4 bytes for each pair.
Buffer<float> path_lengths(const OrderedGraph& graph, std::span<const Cell> sources, double unit,
                           ThreadTeam& team);

// The same from each cell to all cells within `reach` of it (Euclidean; 0 to itself), by the
// shortest path of which all places but the last are within reach. The bound is centered at the
// source, so the paths of a pair of cells may differ between the two directions, or exist in one
// only. Memory: 8 bytes per pair, twice that while rows are concatenated.
SparseRows path_lengths_within(const OrderedGraph& graph, double reach, double unit,
                               ThreadTeam& team);

}  // namespace superfacets
