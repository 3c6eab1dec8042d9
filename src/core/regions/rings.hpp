// Stage 5: the cells around borders between regions.
#pragma once

#include <algorithm>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Whether each given cell has a neighbor with another label. The arcs leave these cells, and lead
// to any cells with labels. Time O(N + M).
Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets, std::span<const Label> labels);

// Spreads ring numbers from vertex to vertex: each vertex of a cell gets at least the largest
// number of the cell's vertices minus one. So a vertex with number n gives each cell within n rings
// around it a vertex with a number of 1 or more. corners_of(cell) is a range of vertices. Time
// O(N max(rings)).
template <typename CornersOf>
void spread_rings(Cell n_cells, const CornersOf& corners_of, std::span<std::uint8_t> rings) {
  // Round by round from the largest number down: a round writes smaller numbers, which the next one
  // reads.
  for (int ring = rings.empty() ? 0 : *std::ranges::max_element(rings); ring > 1; --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (Cell cell = 0; cell < n_cells; ++cell) {
      int largest = 0;
      for (const Vertex corner : corners_of(cell)) largest = std::max<int>(largest, rings[corner]);
      if (largest != ring) continue;  // if larger, it was handled in an earlier round
      for (const Vertex corner : corners_of(cell)) rings[corner] = std::max(rings[corner], less);
    }
  }
}

}  // namespace superfacets
