// Stage 5: the graph-based segmentation that is commonly used for indoor scans (ScanNet).
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Parameters of the segmentation.
struct SegmentLimits {
  // An edge can join a segment of n nodes if its weight is at most threshold / n larger than the
  // weight of the last edge that joined the segment.
  double threshold;
  std::int64_t least;  // minimum number of nodes of a segment
};

// Returns the segment of each node, by the method of Felzenszwalb and Huttenlocher ("Efficient
// Graph-Based Image Segmentation", 2004). Segments are numbered by their lowest nodes. Edge i leads
// from node ends[2 i] to node ends[2 i + 1]. The weight of an edge is its crease_weight. An edge is
// convex if the normal at its end points forward along the edge, so an edge and its reverse may
// have different weights. Edges are processed in ascending order of weight, and in input order if
// weights are equal. In a first pass, an edge joins the two segments at its ends if its weight is
// at most the limit of both segments. The limit of a segment is threshold / size, plus the weight
// of the last edge that joined the segment. In a second pass, edges join segments smaller than
// `least` to neighboring segments. A connected component smaller than `least` is one segment. The
// worst-case time is O(E log V).
Buffer<Cell> graph_segments(std::span<const Point> positions, std::span<const Point> normals,
                            std::span<const Vertex> ends, const SegmentLimits& limits,
                            ThreadTeam& team);

}  // namespace superfacets
