// Stage 5: counts the segments that the usual segmenter of indoor scans would find.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Limits of joining and of counting segments.
struct SegmentLimits {
  // An edge joins a segment of n nodes if its weight exceeds the last weight that joined the
  // segment by at most threshold / n.
  double threshold;
  std::int64_t least;  // minimum number of nodes of a counted segment
};

// Number of segments with at least `least` nodes, by the method of Felzenszwalb and Huttenlocher
// ("Efficient Graph-Based Image Segmentation", 2004). Edge i leads from node ends[2 i] to node
// ends[2 i + 1]. The weight of an edge is its crease_weight. An edge is convex if the normal at its
// end points forward along the edge, so an edge and its reverse may have different weights. Edges
// are processed in ascending order of weight (ties in input order). First, an edge joins the
// segments at its ends if its weight is at most the limit of both segments. The limit of a segment
// is threshold / size, plus the last weight that joined the segment. Second, in the same order,
// edges join segments smaller than `least` to neighboring segments. Time O(E log V) at worst.
std::int64_t count_graph_segments(std::span<const Point> positions, std::span<const Point> normals,
                                  std::span<const Vertex> ends, const SegmentLimits& limits,
                                  ThreadTeam& team);

// Counts the segments of a mesh. Each face (a, b, c) has the edges (a, b), (a, c) and (c, b).
// Corners are replaced by representative[vertex].
std::int64_t count_mesh_segments(std::span<const Point> positions, std::span<const Point> normals,
                                 std::span<const Triangle> faces,
                                 std::span<const Vertex> representative,
                                 const SegmentLimits& limits, ThreadTeam& team);

}  // namespace superfacets
