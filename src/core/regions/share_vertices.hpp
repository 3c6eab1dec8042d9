// Stage 5: gives a vertex to each region that has none.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Corners of labeled cells. Corner i is at vertices[i], and belongs to a cell of region labels[i].
struct LabeledCorners {
  std::span<const Vertex> vertices;
  std::span<const Label> labels;  // all from 0 to n_labels - 1
  Label n_labels;
};

// Changes labels of vertices so that as many regions as possible have a vertex. `winners` is the
// label of each vertex: one of the labels of its corners, or kNoLabel without corners. A region
// without a vertex takes one at a corner of its cells from a region with several vertices, or from
// a region with one vertex that takes another in the same way. Shorter chains come first, then
// chains from lower regions, then chains with lower vertices. No region loses its last vertex.
//
// This is the algorithm of Hopcroft and Karp (1973) for maximum bipartite matchings, where a region
// may have several vertices. Time O(C sqrt(K)) for C corners and K regions without a vertex; mostly
// a few times O(C).
Buffer<Label> share_vertices(const LabeledCorners& corners, std::span<const Label> winners,
                             ThreadTeam& team);

}  // namespace superfacets
