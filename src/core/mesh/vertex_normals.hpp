// Normals of vertices, and the weights of edges that follow from them.
#pragma once

#include <algorithm>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

// The mean of the unit normals of the faces around each vertex, not normalized; zero at vertices
// without faces. Corners are replaced by representative[vertex] (see weld_vertices): vertices that
// are not their own representative have no faces. A face without a normal counts as zero.
Buffer<Point> mean_normals(std::span<const Point> vertices, const CornerLists& faces,
                           std::span<const Vertex> representative);

// Weight of an edge: 1 minus the dot product of the normals at its ends, at least 0. On convex
// edges it is squared, because surfaces are rarely cut there. (Karpathy, Miller, Fei-Fei, "Object
// Discovery in 3D Scenes via Shape Analysis", 2013.)
inline double crease_weight(const Point& a, const Point& b, bool is_convex) {
  const double turn = std::max(1.0 - dot(a, b), 0.0);
  return is_convex ? turn * turn : turn;
}

}  // namespace superfacets
