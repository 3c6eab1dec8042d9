// Stage 5: the cells around borders between regions.
#pragma once

#include <algorithm>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Whether each given cell has a neighbor with another label. `offsets` describes the arcs of the
// given cells; the arcs may lead to any labeled cell. Time O(N + M).
Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets, std::span<const Label> labels);

// Spreads ring numbers over vertices, until every vertex of a cell has at least the largest number
// in the cell minus one. Then each cell within n rings of a vertex with number n has a vertex with
// a number of at least 1. corners_of(cell) is a range of vertices. Time O(N max(rings)).
template <typename CornersOf>
void spread_rings(Cell n_cells, const CornersOf& corners_of, std::span<std::uint8_t> rings) {
  // One round per number, in descending order: each round writes the numbers that the next one
  // reads.
  for (int ring = rings.empty() ? 0 : *std::ranges::max_element(rings); ring > 1; --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (Cell cell = 0; cell < n_cells; ++cell) {
      int largest = 0;
      for (const Vertex corner : corners_of(cell)) largest = std::max<int>(largest, rings[corner]);
      if (largest != ring) continue;  // a larger number was handled in an earlier round
      for (const Vertex corner : corners_of(cell)) rings[corner] = std::max(rings[corner], less);
    }
  }
}

}  // namespace superfacets
