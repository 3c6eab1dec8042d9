// For each of many query points, finds the nearest triangle, tetrahedron or point of a mesh or
// cloud.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// One entry per query, in the order of queries.
struct NearestCells {
  Buffer<Cell> cells;        // nearest cell, the lowest one in ties; -1 if there is none
  Buffer<double> distances;  // infinite if there is none
  Buffer<Point> points;      // the nearest point of that cell; NaN if there is none
};

// Finds only cells within max_distance, which may be infinite. The distance of a cell is the
// distance of its nearest point, and is 0 inside a tetrahedron. Only exactly equal distances are
// ties. Time: about a microsecond per cell, and per query near the surface. Results do not depend
// on the number of threads.
NearestCells nearest_triangles(std::span<const Point> vertices, std::span<const Triangle> triangles,
                               std::span<const Point> queries, double max_distance,
                               ThreadTeam& team);
NearestCells nearest_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                          std::span<const Point> queries, double max_distance, ThreadTeam& team);
NearestCells nearest_points(std::span<const Point> points, std::span<const Point> queries,
                            double max_distance, ThreadTeam& team);

}  // namespace superfacets
