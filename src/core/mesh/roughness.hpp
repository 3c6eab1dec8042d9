// Roughness of a mesh at single vertices, from which noise is estimated.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

// Values of some faces, and of the vertex at the first corner of each.
struct Roughness {
  // Absolute height of the vertex above a quadric through its surroundings. The unit is the mean
  // distance to its neighbors, times the standard deviation that white noise of 1 would give.
  // `near` is fitted to both rings of neighbors, `far` to the second ring. NaN if no fit is unique.
  Buffer<double> near;
  Buffer<double> far;
  Buffer<double> fold;           // angle to the face across the first arc, 0 to pi / 2
  Buffer<double> agreement;      // fraction of pairs of adjacent faces on the same side of the face
  Buffer<std::int32_t> n_faces;  // number of faces around the vertex, 0 if it is on the boundary
};

// Measures some faces. offsets and neighbors are the arcs between faces that share an edge.
// Vertices at one position count as one vertex. The first ring of neighbors consists of all corners
// of the faces around the vertex. The second ring consists of all other corners of the faces around
// the first ring. The results have the same bits for any number of threads and any order of the
// faces of a manifold mesh. Time O(1) per face in `faces`.
Roughness measure_roughness(std::span<const Point> vertices, const CornerLists& corners,
                            std::span<const std::int64_t> offsets, std::span<const Face> neighbors,
                            std::span<const Face> faces, ThreadTeam& team);

}  // namespace superfacets
