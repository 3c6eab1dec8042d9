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
// arcs. A side whose ends have the same representative is not an edge. Time O(C + V), and O(n log
// n) at a vertex with n edges.
VertexGraph build_vertex_graph(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative, ThreadTeam& team);

// For each vertex, the mean of the unit normals of the faces around the vertex. The mean is not
// normalized, and is zero if the vertex has no faces. Corners are replaced by
// representative[vertex] (see weld_vertices), so duplicate vertices have no faces. Degenerate faces
// are included with a zero normal.
Buffer<Point> mean_normals(std::span<const Point> vertices, const CornerLists& faces,
                           std::span<const Vertex> representative);

// Smoothed positions p + g(L) L p, where L p is the vector from the mean of the neighbors of a
// vertex to the vertex, and g(k) is the sum of series[j] * T_j(k - 1), with Chebyshev polynomials
// T_j. Waves of frequency k, 0 to 2, are multiplied by 1 + k g(k). Corners are replaced by
// representative[vertex] (see weld_vertices); duplicates get the position of their representative.
// Vertices without neighbors do not move. `arcs` are the offsets of the arcs between faces, or
// empty if an edge has more than two faces, or two that traverse it in the same direction.
// Displacements are computed as floats.
// Time O(series.size() * (V + C)). The result has the same bits for any number of threads.
Buffer<Point> smooth_positions(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative,
                               std::span<const std::int64_t> arcs, std::span<const double> series,
                               ThreadTeam& team);

}  // namespace superfacets
