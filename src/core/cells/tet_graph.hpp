// Stage 1 for tetrahedra: the graph of those that share a triangle, and measures of its arcs.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/polygon_graph.hpp"

namespace superfacets {

struct TetMeasures {
  Buffer<Point> centroids;      // (N,)
  Buffer<double> volumes;       // (N,) >= 0 for either orientation
  Buffer<double> border_areas;  // (M,) of the triangle that an arc crosses
  Buffer<double> step_lengths;  // (M,) from centroid to centroid over the centroid of the triangle
  Buffer<double> open_areas;    // (N,) of the triangles that no arc crosses
};

// Builds one arc per shared triangle and direction, by the rules of build_polygon_graph. Side s of
// a tetrahedron is the triangle of the corners other than s; a triangle that names a vertex twice
// is no side.
PolygonGraph build_tet_graph(std::span<const Tet> tets, std::span<const Vertex> representative,
                             ThreadTeam& team);

// Both arcs of a pair get the same bits.
TetMeasures measure_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                         const PolygonGraph& graph, ThreadTeam& team);

}  // namespace superfacets
