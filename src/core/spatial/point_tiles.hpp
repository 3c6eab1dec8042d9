// Stage 1 for a tile of a point cloud: computes neighbors and normals from the points of the tile
// and the points around it.
#pragma once

#include "base/lists.hpp"

namespace superfacets {

// The nearest neighbors of n points: one row per point, in ascending order of distance.
struct NearestRows {
  Buffer<Cell> points;     // (n * n_nearest,) index of each neighbor, padded with -1
  Buffer<double> squared;  // (n * n_nearest,) squared distances, padded with infinity
};

// Finds for each wanted point its n_nearest nearest neighbors among all points. Rows are in the
// order of the wanted points. Neighbors at equal distances are sorted by index. All points must
// have different positions.
NearestRows nearest_in_part(std::span<const Point> positions,
                            std::span<const std::uint8_t> is_wanted, std::size_t n_nearest,
                            ThreadTeam& team);

// Estimates the normal of each center from the center and its neighbors (see NormalFit). The sign
// is arbitrary. `centers` and `rows` contain indices of points. `rows` has one row of neighbors per
// center, which ends at the first -1.
Buffer<Point> directions_around(std::span<const Point> positions, std::span<const Point> axes,
                                std::span<const Cell> centers, std::span<const Cell> rows,
                                ThreadTeam& team);

// Groups pairs (sources[i], targets[i]) by source. Returns the list of targets of each cell
// 0..n_cells-1, ascending and without duplicates.
Lists<Place> sorted_lists(Cell n_cells, std::span<const Cell> sources,
                          std::span<const Place> targets);

}  // namespace superfacets
