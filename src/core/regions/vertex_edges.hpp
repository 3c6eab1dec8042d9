// Stage 5: edges between vertices or points, with weights that are high at creases.
#pragma once

#include <bit>

#include "cells/components.hpp"
#include "mesh/vertex_normals.hpp"

namespace superfacets {

struct WeightedEdge {
  std::uint64_t key;  // bits of the weight, in the order of weights
  Vertex a, b;
};

// Returns the bits of a number >= 0 as an integer. Integers ascend with the numbers, and the
// highest bit is 0.
inline std::uint64_t ascending_bits(double weight) {
  return std::bit_cast<std::uint64_t>(weight);
}

// Vertices and their edges in CSR form, each edge in both directions.
struct VertexEdges {
  std::span<const std::int64_t> offsets;  // (V + 1,) arcs of vertex i: offsets[i] .. offsets[i+1]-1
  std::span<const Vertex> neighbors;      // (M,)
  std::span<const Point> positions;       // (V,)
  std::span<const Point> normals;  // (V,) mean of the unit normals around each vertex, or zero

  Vertex n_vertices() const { return static_cast<Vertex>(positions.size()); }
  std::span<const Vertex> of(Vertex vertex) const {
    return neighbors.subspan(offsets[vertex], offsets[vertex + 1] - offsets[vertex]);
  }
  // The crease_weight of an edge, equal in both directions. The edge is convex if the normal at
  // either end points away from the other end. The usual segmenter of indoor scans gives each
  // direction its own weight; this is the lower of the two.
  double weight(Vertex a, Vertex b) const {
    const Point step = positions[b] - positions[a];
    const bool is_convex = dot(normals[b], step) > 0.0 || dot(normals[a], step) < 0.0;
    return crease_weight(normals[a], normals[b], is_convex);
  }
};

// For each edge in order, unites the sets of its two ends if either set is smaller than `least`.
// sizes[root] is the size of the set of a root. The function updates the sizes.
inline void join_small_sets(std::span<const WeightedEdge> edges, std::int64_t least,
                            DisjointSets& sets, std::span<std::int64_t> sizes) {
  for (const WeightedEdge& edge : edges) {
    const Cell a = sets.root(edge.a);
    const Cell b = sets.root(edge.b);
    if (a == b || std::min(sizes[a], sizes[b]) >= least) continue;
    const std::int64_t size = sizes[a] + sizes[b];
    sizes[sets.unite(a, b)] = size;
  }
}

}  // namespace superfacets
