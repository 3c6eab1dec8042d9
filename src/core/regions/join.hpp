// Stage 5: joins small regions to their neighbors.
#pragma once

#include "regions/borders.hpp"

namespace superfacets {

// Selects the regions that must join a neighbor.
struct JoinRule {
  // (K,) 1 if the region must not join a neighbor; empty if all regions may join
  std::span<const std::uint8_t> stays;
  double least_area = 0.0;  // regions with a smaller area join a neighbor
};

// Joins each selected region, in ascending order of area, to the neighbor with the highest border
// cost. Returns for each of the K regions the label of the region that it belongs to afterwards.
// Areas and border costs of joined regions are added. If areas are equal, the region with the lower
// label is joined first. If border costs are equal, the neighbor with the lower number is used; the
// number of a group of joined regions is the label of its region with the most neighbors. A region
// without neighbors does not change. `borders` is the result of region_borders.
//
// Time O((K + B) log^2 B) for B borders, because each join copies the border list of the region
// with fewer neighbors.
std::vector<Label> join_regions(std::span<const double> areas,
                                std::span<const RegionBorder> borders, const JoinRule& rule);

}  // namespace superfacets
