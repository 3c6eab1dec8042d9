// Stage 5: joins regions to their neighbors.
#pragma once

#include "regions/borders.hpp"

namespace superfacets {

// Selects the regions that must join a neighbor.
struct JoinRule {
  // (K,) 1: the region never joins a neighbor; empty: all may join
  std::span<const std::uint8_t> stays;
  double least_area = 0.0;  // regions below this area join
};

// Joins each selected region, in ascending order of area, to the neighbor with the most costly
// common border. Returns the final region of each region, (K,). Areas and borders of joined regions
// are added. Ties go to the lowest label. In ties, the label of a group of joined regions is the
// label of its region with most neighbors. A region without a neighbor does not change. `borders`
// is the result of region_borders.
//
// Time O((K + B) log^2 B) for B borders, because the borders of the region with fewer neighbors are
// added to the region with more.
std::vector<Label> join_regions(std::span<const double> areas,
                                std::span<const RegionBorder> borders, const JoinRule& rule);

}  // namespace superfacets
