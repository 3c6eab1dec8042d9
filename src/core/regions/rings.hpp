// Stage 5 on tiles: the cells around borders between regions.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Whether each given cell has a neighbor with another label. The arcs leave these cells, and lead
// to any cells with labels. Time O(N + M).
Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets, std::span<const Label> labels);

// The corners of cells: those of cell i are offsets[i] .. offsets[i + 1] - 1.
struct CellCorners {
  std::span<const std::int64_t> offsets;  // (N + 1,)
  std::span<const Vertex> corners;

  std::span<const Vertex> of(std::size_t cell) const {
    return corners.subspan(offsets[cell], offsets[cell + 1] - offsets[cell]);
  }
};

// Spreads ring numbers from vertex to vertex: each vertex of a cell gets at least the largest
// number of the cell's vertices minus one. So a vertex with number n gives each cell within n rings
// around it a vertex with a number of 1 or more. Time O(N max(rings)).
void spread_rings(const CellCorners& cells, std::span<std::uint8_t> rings);

}  // namespace superfacets
