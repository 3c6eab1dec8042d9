// Lengths of shortest paths between cells: from some of them to all, or between those near each
// other. What normalized cuts ask for; nothing else here grows with the square of the cells.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// Rows of a sparse matrix, in CSR form.
struct SparseRows {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> columns;          // (E,) rising within a row
  Buffer<float> values;          // (E,)
};

// Row i holds the length of the shortest path from sources[i] to each cell, in units times `unit`;
// infinity where there is none. Time O(S (N + M)) in practice; memory 4 bytes for each pair.
Buffer<float> path_lengths(const OrderedGraph& graph, std::span<const Cell> sources, double unit,
                           ThreadTeam& team);

// The same from each cell to those within `reach` of it (Euclidean, 0 to itself), by the shortest
// path whose places but the last are all within reach. A cell on whose paths that bound falls
// differently from its other end has a longer path one way, or none. 8 bytes for each pair, twice
// that while rows are put together.
SparseRows path_lengths_within(const OrderedGraph& graph, double reach, double unit,
                               ThreadTeam& team);

}  // namespace superfacets
