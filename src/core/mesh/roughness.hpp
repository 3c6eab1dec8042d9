// Measures the roughness of a mesh at single vertices, to estimate its noise.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

// Roughness at some faces, and at the vertex at the first corner of each of these faces. All arrays
// have one entry per face.
struct Roughness {
  // Absolute height of the vertex above a quadric that is fitted to its neighbors: to the first two
  // rings for `near`, and only to the second ring for `far`. The height is divided by the mean
  // distance from the vertex to the first ring, and by the standard deviation that white noise of
  // variance 1 would cause. NaN if a fit is not unique, or if the vertex has too many neighbors.
  Buffer<double> near;
  Buffer<double> far;
  // Angle between the planes of the face and of its first neighbor, 0 to pi / 2. NaN if the face
  // has no neighbors.
  Buffer<double> fold;
  // Fraction of the pairs of neighbors whose centers are on the same side of the plane of the face.
  // NaN if the face has fewer than two neighbors.
  Buffer<double> agreement;
  // Number of faces around the vertex; 0 if the vertex is on the boundary, or has too many
  // neighbors.
  Buffer<std::int32_t> n_faces;
};

// Measures the roughness at `faces`. `offsets` and `neighbors` are the arcs between faces that
// share an edge, in CSR form. Vertices at the same position are treated as one vertex. The first
// ring of neighbors consists of all corners of the faces around the vertex. The second ring
// consists of all other corners of the faces around the first ring. The results have the same bits
// for any number of threads and any order of the faces of a manifold mesh. Time O(1) per face in
// `faces`.
Roughness measure_roughness(std::span<const Point> vertices, const CornerLists& corners,
                            std::span<const std::int64_t> offsets, std::span<const Face> neighbors,
                            std::span<const Face> faces, ThreadTeam& team);

}  // namespace superfacets
