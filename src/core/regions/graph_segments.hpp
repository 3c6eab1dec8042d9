// Stage 5: how many segments the usual segmenter of scans finds.
#pragma once

#include <cstdint>
#include <span>

#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// When nodes are joined, and which segments are counted.
struct SegmentLimits {
  // An edge may exceed the weight that last joined a segment by threshold / (its number of nodes).
  double threshold;
  std::int64_t least;  // minimum number of nodes of a counted segment
};

// Number of segments with at least `least` nodes, by the method of Felzenszwalb and Huttenlocher
// ("Efficient Graph-Based Image Segmentation", 2004). The edges lead from node ends[2 i] to node
// ends[2 i + 1]. The weight of an edge is its crease_weight, convex if the normal at its end points
// forward along it: edges of both directions may have two weights. In the order of ascending weight
// w (of equal weights, the first), an edge joins the segments at its ends if w is at most the limit
// of both. The limit of a segment is threshold / size, plus the weight that joined it last. Then,
// in the same order, edges join segments smaller than `least` to others. Time O(E log V) at worst.
std::int64_t count_graph_segments(std::span<const Point> positions, std::span<const Point> normals,
                                  std::span<const Vertex> ends, const SegmentLimits& limits,
                                  ThreadTeam& team);

// The same for the sides (a, b), (a, c), (c, b) of the faces (a, b, c) of a mesh, with corners
// replaced by representative[vertex].
std::int64_t count_mesh_segments(std::span<const Point> positions, std::span<const Point> normals,
                                 std::span<const Triangle> faces,
                                 std::span<const Vertex> representative,
                                 const SegmentLimits& limits, ThreadTeam& team);

}  // namespace superfacets
