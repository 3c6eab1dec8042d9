// Stage 1 for point clouds: neighbors, areas and normals of points.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct PointGraphOptions {
  std::size_t n_neighbors = 6;  // number of nearest neighbors to which each point is joined, >= 1
  // number of nearest neighbors from which a normal is estimated, >= n_neighbors
  std::size_t n_around = 12;
  // length limit of an arc, as a multiple of the square root of the smaller area at its ends; > 0
  double cutoff = 4.0;
  // True if the caller provides normals, so that no normals are estimated.
  bool has_normals = false;
  // (N,) axis of each point (a normal of unknown sign), or empty. If axes are given, the normal of
  // a point is the mean axis of its neighborhood.
  std::span<const Point> axes;
};

// Cells are points, in the order of a space-filling curve or of the input.
struct PointGraph {
  Buffer<std::int64_t> offsets;  // (N + 1,) start of each cell in `neighbors`
  Buffer<Cell> neighbors;   // (M,) neighbors of each cell, ascending; each arc has a reverse arc
  Buffer<double> measures;  // (N,) area around each cell
  Buffer<Point> normals;    // (N,) unit normals, zero where undefined; empty if normals are given
  Buffer<Cell> points;  // (N,) index of each cell in the input; empty if cells are in input order
  Buffer<Point> positions;  // (N,) position of each cell; empty if cells are in input order
};

// Sorts points along a space-filling curve, so that neighbors are near in memory in all later
// stages. Joins each point to its nearest neighbors by arcs in both directions. If several
// neighbors are equally near, those that come first along the curve are chosen. The lowest point at
// a position is the representative, and all other points there are duplicates. Duplicates are
// joined to their representative only, and share its area.
//
// The area of a point is 2 pi mean(d^2) / (n + 1), with the squared distances d^2 of its n nearest
// neighbors. This is the expected area per point of random points on a plane. Arcs longer than the
// cutoff are dropped, and are not used for the area. A point without arcs has area 0.
//
// The normal of a point is the direction of least variance of its neighbors. Normals are flipped
// consistently and outwards (see turn_consistently). Positions must be finite. Duplicates come last
// in the order. Time O(N log N) in practice; memory 150 bytes per point in addition to the input.
PointGraph build_point_graph(std::span<const Point> positions, const PointGraphOptions& options,
                             ThreadTeam& team);

// Returns the graph with its points numbered in the order of the input.
PointGraph in_input_order(const PointGraph& sorted, ThreadTeam& team);

}  // namespace superfacets
