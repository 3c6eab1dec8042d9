// Stage 5: labels vertices or points, with borders along creases.
#pragma once

#include "regions/vertex_edges.hpp"

namespace superfacets {

// Labels the vertices with kNoLabel, by extending the given labels with Kruskal's algorithm. In
// ascending order of weight, each edge with an unlabeled end unites the sets of its two ends,
// unless both sets have a label. If weights are equal, as in planes, edges whose ends have equal
// hints are processed first. Labeled vertices keep their label, and every other vertex gets the
// label of its set. A vertex that is not connected to a labeled vertex keeps kNoLabel. The result
// does not depend on the number of threads.
Buffer<Label> spread_labels(const VertexEdges& edges, std::span<const Label> labels,
                            std::span<const Label> hints, ThreadTeam& team);

// Minimum size of regions of vertices.
struct LeastSize {
  std::span<const std::int32_t> counts;  // (V,) size of each vertex
  Label n_labels;                        // number of regions
  std::int64_t least;                    // minimum sum of the sizes of a region's vertices
};

// Grows each region smaller than `least`, in the order of labels. A small region repeatedly takes
// over the adjacent vertex of another region that has the edge with the lowest weight, until the
// region is large enough. The other region must keep a size of at least `least` and stay connected,
// which is checked by a search of limited length. A region that cannot get enough vertices does not
// change.
Buffer<Label> grow_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                 const LeastSize& size);

// Unites each region smaller than `least` with a neighbor, in ascending order of edge weight. The
// united region gets the lower of the two labels. Regions without neighbors do not change, even if
// they are small. All vertices with edges must have labels.
Buffer<Label> merge_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                  const LeastSize& size);

}  // namespace superfacets
