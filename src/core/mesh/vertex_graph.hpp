// Stage 6: the graph of vertices that share an edge, for distances along the edges of a mesh.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {

struct VertexGraph {
  Buffer<std::int64_t> offsets;  // (V + 1,) arcs of vertex i: offsets[i] .. offsets[i+1]-1
  Buffer<Vertex> neighbors;      // (M,) ascending for each vertex, without duplicates
  Buffer<double> lengths;        // (M,) length of the edge of each arc
};

// Builds one arc per edge and direction. Corners are replaced by representative[vertex] (see
// weld_vertices): vertices that are not used, or not their own representative, have no arcs. A side
// whose ends have the same representative is no edge. Time O(F + V), and O(n log n) at a vertex
// with n edges.
VertexGraph build_vertex_graph(std::span<const Point> vertices, std::span<const Triangle> faces,
                               std::span<const Vertex> representative, ThreadTeam& team);
VertexGraph build_vertex_graph(std::span<const Point> vertices, const Polygons& faces,
                               std::span<const Vertex> representative, ThreadTeam& team);

}  // namespace superfacets
