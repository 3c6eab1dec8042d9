// Stage 1 for tetrahedra: which of them share a triangle, and the measures of their arcs.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/polygon_graph.hpp"

namespace superfacets {

struct TetMeasures {
  Buffer<Point> centroids;      // (N,)
  Buffer<double> volumes;       // (N,) >= 0, whichever way a tetrahedron is turned
  Buffer<double> border_areas;  // (M,) of the triangle that an arc crosses
  Buffer<double> step_lengths;  // (M,) from centroid to centroid over that of the triangle
  Buffer<double> open_areas;    // (N,) of the triangles that no arc crosses
};

// Builds one arc per shared triangle and direction, by the rules of build_polygon_graph. Side s of
// a tetrahedron is the triangle of the corners other than s; one that names a vertex twice is none.
PolygonGraph build_tet_graph(std::span<const Tet> tets, std::span<const Vertex> representative,
                             ThreadTeam& team);

// Both arcs of a pair get the same bits.
TetMeasures measure_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                         const PolygonGraph& graph, ThreadTeam& team);

}  // namespace superfacets
