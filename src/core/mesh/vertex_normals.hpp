// Normals of vertices, and weights of edges computed from these normals.
#pragma once

#include "base/buffer.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

// For each vertex, the mean of the unit normals of the faces around the vertex. The mean is not
// normalized, and is zero if the vertex has no faces. Corners are replaced by
// representative[vertex] (see weld_vertices), so duplicates have no faces. In the mean, the normal
// of a degenerate face is the zero vector.
Buffer<Point> mean_normals(std::span<const Point> vertices, const CornerLists& faces,
                           std::span<const Vertex> representative);

// Weight of an edge: 1 minus the dot product of the normals at its ends, at least 0. The weight of
// a convex edge is squared, because objects rarely meet at convex edges. (Karpathy, Miller,
// Fei-Fei, "Object Discovery in 3D Scenes via Shape Analysis", 2013.)
inline double crease_weight(const Point& a, const Point& b, bool is_convex) {
  const double turn = std::max(1.0 - dot(a, b), 0.0);
  return is_convex ? turn * turn : turn;
}

}  // namespace superfacets
