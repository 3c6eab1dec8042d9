// Stage 5: labels of vertices or points, with borders along creases.
#pragma once

#include "regions/vertex_edges.hpp"

namespace superfacets {

// Gives labels to the vertices with kNoLabel, by Kruskal's algorithm. In ascending order of weight,
// each edge with an unlabeled end unites the sets of its two ends, unless both sets have a label.
// Ties of weight, as in planes, go to edges whose ends have equal hints. Labeled vertices keep
// their label, and every other vertex gets the label of its set. A vertex that no chain of edges
// joins to a labeled vertex keeps kNoLabel. The result does not depend on the number of threads.
Buffer<Label> spread_labels(const VertexEdges& edges, std::span<const Label> labels,
                            std::span<const Label> hints, ThreadTeam& team);

// Minimum size of regions of vertices.
struct LeastSize {
  // (V,) size of each vertex; the size of a region is the sum
  std::span<const std::int32_t> counts;
  Label n_labels;
  std::int64_t least;
};

// Grows each region smaller than `least`, in the order of labels. A small region repeatedly takes
// the vertex of another region across the edge of lowest weight, until it is large enough. The
// other region must keep a size of at least `least` and stay connected, which a search of limited
// length around the vertex must show. A region that cannot get enough vertices does not change.
Buffer<Label> grow_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                 const LeastSize& size);

// Unites each region smaller than `least` with a neighbor, in ascending order of edge weight. The
// united region gets the lower of the two labels. Regions without neighbors may stay smaller.
// Precondition: all vertices with edges have labels.
Buffer<Label> merge_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                  const LeastSize& size);

}  // namespace superfacets
