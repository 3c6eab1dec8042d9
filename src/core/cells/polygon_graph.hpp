// Stage 1: the graph of polygons that share an edge.
#pragma once

#include "cells/side_graph.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {

using PolygonGraph = SideGraph<std::int32_t>;

// Builds one arc per shared edge and direction, with the same rules as build_triangle_graph. For
// triangles, both functions build the same arcs. Side s of a face joins its corners s and s + 1;
// the last side joins the last corner and the first.
//
// Time O(C + V + M) for C corners, V vertices and M arcs, and O(n log n) at a vertex with n edges.
// Memory in addition to the result: at most about 8 bytes per corner. Throws std::length_error
// before it allocates arcs, if there are too many arcs.
PolygonGraph build_polygon_graph(const Polygons& faces, std::span<const Vertex> representative,
                                 ThreadTeam& team);

}  // namespace superfacets
