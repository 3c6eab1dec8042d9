// Stage 1: the graph of polygons that share an edge.
#pragma once

#include "cells/face_graph.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {

// Graph of polygons or tetrahedra: like FaceGraph, with 32-bit side numbers.
struct PolygonGraph {
  Buffer<std::int64_t> offsets;    // (F + 1,) arcs of face i: offsets[i] .. offsets[i+1]-1
  Buffer<Face> neighbors;          // (M,) target face of each arc
  Buffer<std::int32_t> sides;      // (M,) side of the face that each arc crosses
  Buffer<std::uint8_t> same_turn;  // (M,) 1 if both faces traverse the edge in the same direction
  EdgeCounts counts;
};

// Builds one arc per shared edge and direction, with the same rules as build_face_graph. For
// triangles, both functions build the same arcs. Side s of a face joins its corners s and s + 1;
// the last side joins the last corner and the first.
//
// Time O(C + V + M), and O(n log n) at a vertex with n edges. Memory in addition to the result:
// about 30 bytes per corner. Throws std::length_error before it allocates arcs, if there are too
// many arcs.
PolygonGraph build_polygon_graph(const Polygons& faces, std::span<const Vertex> representative,
                                 ThreadTeam& team);

}  // namespace superfacets
