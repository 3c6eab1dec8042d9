// The graph of vertices joined by edges, normals of vertices, and smoothing of positions.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "mesh/corner_lists.hpp"

namespace superfacets {

struct VertexGraph {
  Buffer<std::int64_t> offsets;  // (V + 1,) arcs of vertex i: offsets[i] .. offsets[i+1]-1
  Buffer<Vertex> neighbors;      // (M,) neighbors of each vertex, ascending and without duplicates
  Buffer<double> lengths;        // (M,) length of the edge of each arc
};

// Builds one arc per edge and direction. Corners are replaced by representative[vertex] (see
// weld_vertices). Unused vertices and duplicates (vertices with another representative) have no
// arcs. A side whose ends have the same representative is not an edge. Time O(C + V) for C
// corners and V vertices, and O(n log n) at a vertex with n edges.
VertexGraph build_vertex_graph(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative, ThreadTeam& team);

// For each vertex, the mean of the unit normals of the faces around the vertex. The mean is not
// normalized, and is zero if the vertex has no faces. Corners are replaced by
// representative[vertex] (see weld_vertices), so duplicate vertices have no faces. Degenerate faces
// are included with a zero normal.
Buffer<Point> mean_normals(std::span<const Point> vertices, const CornerLists& faces,
                           std::span<const Vertex> representative);

// Positions after n_steps > 0 steps of Taubin's smoothing ("A Signal Processing Approach to Fair
// Surface Design", 1995), which removes bumps about as wide as an edge. A step moves each vertex
// toward the mean of its neighbors, by 0.5 of the distance, and then away, by 0.53. All steps are
// one Chebyshev series, cut at an error of 1e-5: 20 steps take 15 passes instead of 40. Duplicates
// get the position of their representative. `arcs` are the offsets of the arcs between faces, or
// empty if an edge has three faces, or two that traverse it in the same direction. The result has
// the same bits for any number of threads.
Buffer<Point> smooth_positions(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative,
                               std::span<const std::int64_t> arcs, int n_steps, ThreadTeam& team);

}  // namespace superfacets
