// For each of many query points, finds the nearest triangle, tetrahedron or point of a mesh or
// cloud.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// One entry per query, in their order.
struct NearestCells {
  Buffer<Cell> cells;        // the lowest of equally near cells; -1 if all are beyond max_distance
  Buffer<double> distances;  // infinite if there is none
  Buffer<Point> points;      // the nearest point of that cell; NaN if there is none
};

// Cells beyond max_distance, which may be infinite, are not found. Distances are measured to the
// nearest point of a cell, and are 0 inside a tetrahedron. Only exactly equal distances are ties.
// Time: about a microsecond per cell, and per query near the surface. Results do not depend on the
// number of threads.
NearestCells nearest_triangles(std::span<const Point> vertices, std::span<const Triangle> triangles,
                               std::span<const Point> queries, double max_distance,
                               ThreadTeam& team);
NearestCells nearest_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                          std::span<const Point> queries, double max_distance, ThreadTeam& team);
NearestCells nearest_points(std::span<const Point> points, std::span<const Point> queries,
                            double max_distance, ThreadTeam& team);

}  // namespace superfacets
