// The nearest triangle, tetrahedron or point of a mesh or cloud to each of many points.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Of each query, in their order.
struct NearestCells {
  Buffer<Cell> cells;        // the lowest of equally near ones; -1 where all are too far
  Buffer<double> distances;  // infinite there
  Buffer<Point> points;      // the nearest point of that cell; NaN there
};

// Cells farther than max_distance, which may be infinite, are not found. Distances are to the whole
// of a cell, and 0 inside of a tetrahedron; those that are equal but for rounding are not ties.
// About a microsecond per query near the surface, and as much per cell. Results do not depend on
// the number of threads.
NearestCells nearest_triangles(std::span<const Point> vertices, std::span<const Triangle> triangles,
                               std::span<const Point> queries, double max_distance,
                               ThreadTeam& team);
NearestCells nearest_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                          std::span<const Point> queries, double max_distance, ThreadTeam& team);
NearestCells nearest_points(std::span<const Point> points, std::span<const Point> queries,
                            double max_distance, ThreadTeam& team);

}  // namespace superfacets
