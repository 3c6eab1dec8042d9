// Stage 1: the graph of triangles that share an edge.
#pragma once

#include "cells/side_graph.hpp"

namespace superfacets {

using TriangleGraph = SideGraph<std::uint8_t>;

// Builds one arc per shared edge and direction. Side s of a face joins its corners s and s + 1. Two
// corners are equal if their vertices have the same representative (see weld_vertices). All pairs
// of faces around a non-manifold edge are neighbors, except at an edge of more than kMostPaired
// faces (see for_each_linked). A boundary edge has no arc. A side whose two
// ends are the same vertex is not an edge. A face is never its own neighbor: if two sides of a face
// are on one edge, only the first is used. Faces that share two edges are joined by two arcs in
// each direction. The arcs of a face are sorted by side, then by neighbor. The mesh has at most
// 2^31 - 1 faces and vertices; sides and arcs are counted in 64 bits.
//
// Time O(F + V + M), and O(n log n) at a vertex with n edges. Memory in addition to the result: at
// most about 15 bytes per face, and 8 more if the faces are not sorted. Throws std::length_error
// before it allocates arcs, if there are too many arcs (see check_number_of_arcs).
TriangleGraph build_triangle_graph(std::span<const Triangle> faces,
                                   std::span<const Vertex> representative, ThreadTeam& team);

}  // namespace superfacets
