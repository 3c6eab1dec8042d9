// Stage 1 for tetrahedra: the graph of tetrahedra that share a triangle, and the measures of its
// arcs.
#pragma once

#include "cells/side_graph.hpp"

namespace superfacets {

using TetGraph = SideGraph<std::int32_t>;

struct TetMeasures {
  Buffer<Point> centroids;      // (N,) centroid of each tetrahedron
  Buffer<double> volumes;       // (N,) unsigned volume of each tetrahedron
  Buffer<double> border_areas;  // (M,) area of the triangle that each arc crosses
  // (M,) length of the path between the two centroids via the centroid of the triangle
  Buffer<double> step_lengths;
  Buffer<double> open_areas;  // (N,) total area of each tetrahedron's sides that no arc crosses
};

// Builds one arc per shared triangle and direction, with the same rules as build_polygon_graph.
// Side s of a tetrahedron is the triangle of all corners except s. A triangle with two equal
// vertices is not a side.
TetGraph build_tet_graph(std::span<const Tet> tets, std::span<const Vertex> representative,
                         ThreadTeam& team);

// Computes all measures. An arc and its reverse arc get bit-identical measures.
TetMeasures measure_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                         const TetGraph& graph, ThreadTeam& team);

}  // namespace superfacets
