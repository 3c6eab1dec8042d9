// Stage 1 for point clouds: who is a neighbor of whom, the area around each point, and its normal.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct PointGraphOptions {
  std::size_t n_neighbors = 6;  // arcs lead to as many nearest neighbors, and back; >= 1
  std::size_t n_around = 12;    // nearest neighbors that a normal is estimated from; >= n_neighbors
  double cutoff = 4.0;          // longest arc, in square roots of the smaller area at its ends; > 0
  bool has_normals = false;     // normals are known: none are estimated
};

// Cells are points in an order in which near ones follow each other, or in that of the input.
struct PointGraph {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> neighbors;        // (M,) ascending for each cell; each arc has one back
  Buffer<double> measures;       // (N,) area around each cell
  Buffer<Point> normals;         // (N,) of length 1, or 0 where none exists; empty if known before
  Buffer<Cell> points;           // (N,) the number in the input; empty in that order
  Buffer<Point> positions;       // (N,) likewise
};

// Sorts points along a space-filling curve, so that all that follows finds near ones near in
// memory, and joins each to its nearest neighbors, and these to it; of points at equal distances,
// to those of the lowest indices. Points at the same position count as one: all are joined to the
// lowest of them, and share its area.
//
// With the squared distances d^2 of the n nearest neighbors, the area is 2 pi mean(d^2) / (n + 1):
// the expected area per point if points are spread on a plane at random. Arcs longer than the
// cutoff are dropped, and then neither count in the area; a point without arcs has none.
//
// A normal is the direction in which the neighbors around a point vary least. Normals are turned
// consistently along a minimum spanning tree of each component, by 1 - |n_i . n_j| (Hoppe et al.
// 1992), so that the volume they enclose is positive, seen from the mean of the component.
// Positions are finite. Of points at one position, all but the lowest are last. Time O(N log N) in
// practice; memory 150 bytes a point beside the input.
PointGraph build_point_graph(std::span<const Point> positions, const PointGraphOptions& options,
                             ThreadTeam& team);

// The same graph, of points in the order of the input.
PointGraph in_input_order(const PointGraph& sorted, ThreadTeam& team);

}  // namespace superfacets
