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
  Buffer<Place> places;          // (V,) index in `vertices` of each vertex of the input
};

// Sorts vertices and cells along a Morton curve, cells by the mean of their corners. Faces are
// rotated, so that the first of their vertices on the curve comes first; corners of other cells are
// sorted. So the result, except for `order`, does not depend on the order of the input, unless
// vertices that are not welded have the same position. Equal cells are sorted by index. Vertices
// are welded: `representative` contains the vertex that stands for each vertex, and for itself.
// Unused vertices are kept. Takes O((V + C) log(V + C)) time at most. Uses at most 4 bytes per
// corner, 8 per vertex and 16 per cell in addition to the result.
SortedMesh sort_mesh(std::span<const Point> vertices, std::span<const Vertex> representative,
                     const CornerLists& cells, bool are_faces, ThreadTeam& team);

}  // namespace superfacets
