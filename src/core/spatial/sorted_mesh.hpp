// Renumbers a mesh along a space-filling curve, so that neighbors are near in memory.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// The corners of all cells of a mesh, one cell after the other.
struct CornerLists {
  std::span<const Vertex> corners;  // (C,)
  std::span<const std::int64_t>
      offsets;            // (N + 1,) into corners; empty if all cells have `size` corners
  std::int64_t size = 0;  // number of corners of every cell, if there are no offsets

  Cell n_cells() const {
    return static_cast<Cell>(offsets.empty() ? std::ssize(corners) / size
                                             : std::ssize(offsets) - 1);
  }
  std::int64_t begin_of(std::int64_t cell) const {
    return offsets.empty() ? size * cell : offsets[cell];
  }
  std::span<const Vertex> operator[](std::int64_t cell) const {
    return corners.subspan(begin_of(cell), begin_of(cell + 1) - begin_of(cell));
  }
};

struct SortedMesh {
  Buffer<Point> vertices;        // one vertex per position
  Buffer<Vertex> corners;        // (C,) corners of the sorted cells, as indices into `vertices`
  Buffer<std::int64_t> offsets;  // (N + 1,); empty if the input has no offsets
  Buffer<Cell> order;            // (N,) index of each sorted cell in the input
};

// Sorts vertices along a Morton curve, and cells by the first of their vertices on it, then by
// index. Vertices are welded: `representative` is the result of weld_vertices. Unused vertices are
// kept, and corners keep their order within a cell. Expected time O(V log V + C) at worst; memory
// at most 4 bytes per corner, 8 per vertex and 16 per cell in addition to the result.
SortedMesh sort_mesh(std::span<const Point> vertices, std::span<const Vertex> representative,
                     const CornerLists& cells, ThreadTeam& team);

}  // namespace superfacets
