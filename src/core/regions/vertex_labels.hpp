// Stage 5: labels of vertices, or points, whose borders follow creases.
#pragma once

#include <cstdint>
#include <span>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "regions/vertex_edges.hpp"

namespace superfacets {

// Gives labels to the vertices with kNoLabel, by Kruskal's algorithm: in the order of ascending
// weight, each edge with such a vertex unites the sets of vertices at its ends, unless both have a
// label. Of edges with equal weights, as in planes, those whose ends have equal hints come first.
// Vertices with a label keep it, and the others get one of a set that they are connected with;
// kNoLabel remains where no chain of edges leads to a label. The same on any number of threads.
Buffer<Label> spread_labels(const VertexEdges& edges, std::span<const Label> labels,
                            std::span<const Label> hints, ThreadTeam& team);

// The size that regions of vertices should have.
struct LeastSize {
  std::span<const std::int32_t> counts;  // (V,) what each vertex adds to the size of its region
  Label n_labels;
  std::int64_t least;
};

// Lets each region smaller than `least`, in the order of labels, take vertices of other regions
// over the edge with the lowest weight, until it is large enough. Regions give vertices only as
// long as they keep `least` and stay connected, as far as a search around the vertex shows. A
// region that does not get enough stays as it is.
Buffer<Label> grow_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                 const LeastSize& size);

// Unites regions smaller than `least` with others, over the edges with the lowest weights first. A
// united region has the lowest of its labels. Only regions without neighbors stay smaller. All
// vertices with edges have labels.
Buffer<Label> merge_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                  const LeastSize& size);

}  // namespace superfacets
