// Stage 1 for point clouds: neighbors, areas and normals of points.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct PointGraphOptions {
  std::size_t n_neighbors = 6;  // nearest neighbors that a point has arcs to, and from; >= 1
  std::size_t n_around = 12;    // nearest neighbors that a normal is estimated from; >= n_neighbors
  double cutoff = 4.0;          // longest arc, in square roots of the smaller area at its ends; > 0
  bool has_normals = false;     // normals are known: none are estimated
  // Normals of unknown sign, (N,) or empty. Normals are those that the axes around are closest to.
  std::span<const Point> axes;
};

// Cells are points, in the order of a space-filling curve or of the input.
struct PointGraph {
  Buffer<std::int64_t> offsets;  // (N + 1,)
  Buffer<Cell> neighbors;        // (M,) ascending for each cell; each arc has a reverse arc
  Buffer<double> measures;       // (N,) area around each cell
  Buffer<Point> normals;         // (N,) of length 1, or 0 if undefined; empty if given
  Buffer<Cell> points;           // (N,) the number in the input; empty in the order of the input
  Buffer<Point> positions;       // (N,); empty in the order of the input
};

// Sorts points along a space-filling curve, so that neighbors are near in memory in all later
// stages, and joins each to its nearest neighbors in both directions; the lowest indices win ties.
// Duplicates, all points at a position but the lowest, are joined to that one, and share its area.
//
// With the squared distances d^2 of the n nearest neighbors, the area is 2 pi mean(d^2) / (n + 1):
// the expected area per point if points are spread on a plane at random. Arcs longer than the
// cutoff are dropped, and then neither count in the area; a point without arcs has none.
//
// A normal is the direction in which the neighbors around a point vary least. Normals are flipped
// to agree along a minimum spanning tree of each component, by 1 - |n_i . n_j| (Hoppe et al. 1992),
// so that the volume that they enclose is positive, seen from the mean of the component. Positions
// are finite. Duplicates are last in the order. Time O(N log N) in practice; memory 150 bytes per
// point beside the input.
PointGraph build_point_graph(std::span<const Point> positions, const PointGraphOptions& options,
                             ThreadTeam& team);

// The same graph, of points in the order of the input.
PointGraph in_input_order(const PointGraph& sorted, ThreadTeam& team);

}  // namespace superfacets
