// Stage 5 on tiles: the cells around borders between regions.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Whether each of some cells has a neighbor of another label. The arcs leave these cells, and lead
// to any that have labels. Time O(N + M).
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

// Spreads numbers of rings from vertex to vertex: each of a cell gets at least one less than the
// largest of its vertices. So a number of n brings all cells within n rings to have a vertex of 1
// or more. Time O(N max(rings)).
void spread_rings(const CellCorners& cells, std::span<std::uint8_t> rings);

// What a band, of all cells with a vertex of 1 or more, takes of a tile.
struct BandOfTile {
  std::vector<std::int64_t> cells;
  std::vector<std::int64_t> rim;  // which of these have a vertex of 0, too
  std::vector<std::int32_t> corner_counts;
  std::vector<Vertex> corners;         // numbered among the vertices used
  std::vector<std::int64_t> vertices;  // used, ascending
  std::vector<std::int32_t> arc_counts;
  std::vector<std::int64_t> arcs;
};

// Side s of a cell is that between its corners s and s + 1, and sides are those that arcs leave by.
// Arcs across a side between two vertices of 0 are left out: the cells at both ends are at the rim,
// or outside. Time O(N + M).
BandOfTile cut_band(const CellCorners& cells, std::span<const std::uint8_t> rings,
                    std::span<const std::int64_t> arc_offsets, std::span<const std::int32_t> sides);

}  // namespace superfacets
