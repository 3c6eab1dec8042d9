// Stage 0: faces bisected until no edge is too long.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct Subdivision {
  Buffer<Point> vertices;       // vertices of the input, then midpoints
  Buffer<Triangle> faces;       // all parts of face 0, then of face 1, ...
  Buffer<Face> sources;         // the input face of each part
  Buffer<std::uint8_t> depths;  // number of halvings: a part has 2^-depth of the area of its source
};

// Bisects the longest side of every face, and of every part, until no side is longer than max_edge.
// A side that is too long is bisected in all of its faces, and no other side is, so that no
// T-junctions appear, whatever the number of faces on an edge. Whether and where a side is bisected
// depends on the positions of its ends only, so that unwelded seams stay without gaps; midpoints
// are shared by faces with the same two vertices. The smallest angle of a part is at least half the
// smallest angle of its face. Of equally long sides the first is bisected; parts keep the
// orientation of their face.
//
// max_edge is positive, infinity included, and large compared with the rounding of coordinates.
// Time O(F + V + number of parts), and O(n log n) at a vertex with n long sides. Throws
// std::length_error before it allocates the result, if there would be more than max_faces parts, or
// too many vertices to index.
Subdivision subdivide(std::span<const Point> vertices, std::span<const Triangle> faces,
                      double max_edge, std::int64_t max_faces, ThreadTeam& team);

}  // namespace superfacets
