// Stage 5: edges between vertices or points, with large weights at creases.
#pragma once

#include "cells/components.hpp"

namespace superfacets {

struct WeightedEdge {
  std::uint64_t key;  // sort key computed from the weight; see ascending_bits
  Vertex a, b;        // ends of the edge
};

// Returns the bits of a number >= 0 as an integer. The integers have the same order as the numbers,
// and their highest bit is 0.
inline std::uint64_t ascending_bits(double weight) {
  return std::bit_cast<std::uint64_t>(weight);
}

// Weight of an edge: 1 minus the dot product of the normals at its ends, at least 0. The weight of
// a convex edge is squared, because objects rarely meet at convex edges. (Karpathy, Miller,
// Fei-Fei, "Object Discovery in 3D Scenes via Shape Analysis", 2013.)
inline double crease_weight(const Point& a, const Point& b, bool is_convex) {
  const double turn = std::max(1.0 - dot(a, b), 0.0);
  return is_convex ? turn * turn : turn;
}

// Vertices and their edges in CSR form, each edge in both directions.
struct VertexEdges {
  std::span<const std::int64_t> offsets;  // (V + 1,) arcs of vertex i: offsets[i] .. offsets[i+1]-1
  std::span<const Vertex> neighbors;      // (M,) target vertex of each arc
  std::span<const Point> positions;       // (V,) position of each vertex
  std::span<const Point> normals;         // (V,) mean unit normal around each vertex, or zero

  Vertex n_vertices() const { return static_cast<Vertex>(positions.size()); }
  std::span<const Vertex> of(Vertex vertex) const {
    return neighbors.subspan(offsets[vertex], offsets[vertex + 1] - offsets[vertex]);
  }
  // The crease_weight of an edge, equal in both directions. The edge is convex if the normal at one
  // of its ends points away from the other end. In the ScanNet segmentator, an edge may be convex
  // in one direction only; here it is then convex in both.
  double weight(Vertex a, Vertex b) const {
    const Point step = positions[b] - positions[a];
    const bool is_convex = dot(normals[b], step) > 0.0 || dot(normals[a], step) < 0.0;
    return crease_weight(normals[a], normals[b], is_convex);
  }
};

// Visits the edges in order, and unites the sets of the two ends of an edge if one of the sets is
// smaller than `least`. sizes[root] is the size of each set, and is updated.
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
