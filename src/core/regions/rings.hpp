// Stage 5: finds vertices near borders between regions.
#pragma once

#include "base/buffer.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Increases the ring numbers of vertices, until each vertex of a cell has at least the largest
// number in the cell minus one. So each cell within n rings of a vertex with the number n gets a
// vertex with a number of at least 1. corners_of(cell) is a range of vertices. Time O(N
// max(rings)).
template <typename CornersOf>
void spread_rings(Cell n_cells, const CornersOf& corners_of, std::span<std::uint8_t> rings) {
  // One round per ring number, in descending order. Each round sets the ring numbers that the next
  // round reads.
  for (int ring = rings.empty() ? 0 : *std::ranges::max_element(rings); ring > 1; --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (Cell cell = 0; cell < n_cells; ++cell) {
      int largest = 0;
      for (const Vertex corner : corners_of(cell)) largest = std::max<int>(largest, rings[corner]);
      if (largest != ring) continue;  // larger numbers were processed in an earlier round
      for (const Vertex corner : corners_of(cell)) rings[corner] = std::max(rings[corner], less);
    }
  }
}

}  // namespace superfacets
