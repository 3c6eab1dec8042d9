// Stage 5: the connected pieces of regions.
#pragma once

#include "buffer.hpp"
#include "types.hpp"

namespace superfacets {

struct Pieces {
  Buffer<Cell> of_cell;  // (N,) piece of each cell, 0..P-1, in the order of their lowest cells
  Cell n_pieces = 0;
};

// Two cells are in one piece if a path between them stays in one label. Labels may be any numbers.
// Time O(N + M).
Pieces find_pieces(std::span<const std::int64_t> offsets, std::span<const Cell> neighbors,
                   std::span<const Label> labels);

}  // namespace superfacets
