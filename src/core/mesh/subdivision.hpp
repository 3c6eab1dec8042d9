// Stage 0: bisects faces until all edges are short enough.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct Subdivision {
  Buffer<Point> vertices;  // vertices of the input, followed by the midpoints
  Buffer<Triangle> faces;  // all parts of input face 0, followed by all parts of face 1, and so on
  Buffer<Face> sources;    // input face of each part
  // number of bisections that made each part; the part's area is 2^-depth times the area of its
  // source
  Buffer<std::uint8_t> depths;
};

// Bisects the longest side of every face, and of every part, until no side is longer than max_edge.
// A side that is too long is bisected in all of its faces, so there are no T-junctions, even on
// non-manifold edges. No other side is bisected. Whether and where a side is bisected depends only
// on the positions of its ends, so unwelded seams get no gaps. Faces with the same two vertices
// share the midpoints between these vertices. The smallest angle of a part is at least half the
// smallest angle of its face. If several sides are equally long, the first is bisected. Parts keep
// the orientation of their face.
//
// max_edge must be positive and large compared with the rounding errors of coordinates. It may be
// infinite. Time O(F + V + number of parts), and O(n log n) at a vertex with n long sides. Throws
// std::length_error before it allocates the result, if there would be more than max_faces parts, or
// too many vertices to index.
Subdivision subdivide(std::span<const Point> vertices, std::span<const Triangle> faces,
                      double max_edge, std::int64_t max_faces, ThreadTeam& team);

}  // namespace superfacets
