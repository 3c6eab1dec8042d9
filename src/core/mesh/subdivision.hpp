// Stage 0: faces bisected until no edge is too long.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct Subdivision {
  Buffer<Point> vertices;       // the old ones, then midpoints
  Buffer<Triangle> faces;       // the parts of old face i stand together, in the order of the old
  Buffer<Face> sources;         // the old face that each is a part of
  Buffer<std::uint8_t> depths;  // how often that face was halved: the part has 2^-depth of its area
};

// Bisects the longest side of every face, and of every part of one, until no side is longer than
// max_edge. A side that is longer is bisected in all faces on it, and no other is, so that a mesh
// without T-junctions stays one, whatever the number of faces on an edge. Vertices at one position
// need not be one: whether and where a side is bisected depends on the positions of its ends alone,
// and midpoints are shared by the faces that name the same two vertices. The smallest angle of a
// part is at least half the smallest angle of its face. Among equally long sides the first is
// bisected; parts keep the orientation of their face.
//
// max_edge is positive, infinity included, and large against the rounding of the coordinates. Time
// O(F + V + number of parts) and O(n log n) at a vertex with n long sides. Throws std::length_error
// where there would be more than max_faces parts, or too many vertices to index, before memory is
// taken for them.
Subdivision subdivide(std::span<const Point> vertices, std::span<const Triangle> faces,
                      double max_edge, std::int64_t max_faces, ThreadTeam& team);

}  // namespace superfacets
