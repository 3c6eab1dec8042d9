// Renumbers a mesh along a space-filling curve, so that neighbors are near in memory.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

struct SortedMesh {
  Buffer<Point> vertices;        // welded vertices in sorted order
  Buffer<Vertex> corners;        // (C,) corners of the sorted cells, as indices into `vertices`
  Buffer<std::int64_t> offsets;  // (N + 1,) start of each sorted cell in `corners`; may be empty
  Buffer<Cell> order;            // (N,) index of each sorted cell in the input
};

// Sorts vertices along a Morton curve, and cells by the first of their vertices on the curve, then
// by index. Vertices are welded: `representative` is the result of weld_vertices. Unused vertices
// are kept, and corners keep their order within a cell. Takes O(V log V + C) time
// at most. Uses at most 4 bytes per corner, 8 per vertex and 16 per cell in addition to the result.
SortedMesh sort_mesh(std::span<const Point> vertices, std::span<const Vertex> representative,
                     const CornerLists& cells, ThreadTeam& team);

}  // namespace superfacets
