// Stage 5: joins regions to neighbors.
#pragma once

#include <vector>

#include "regions/borders.hpp"

namespace superfacets {

// The regions that must join another.
struct JoinRule {
  std::span<const std::uint8_t> stays;  // (K,) 1: never joins; empty: all may
  double least_area = 0.0;              // regions below this area join
};

// Joins regions to neighbors, the smallest region first (the lowest label among equals), each to
// the neighbor with the most costly common border, and returns the final region of each, (K,).
// Areas and borders of joined regions are added. Among equal costs the lowest label is taken (a
// group of joined regions has the label of the one with most neighbors). A region without a
// neighbor stays. `borders` are the result of region_borders.
//
// Time O((K + B) log^2 B) for B borders: when two regions join, the borders of the one with fewer
// neighbors are moved to the other.
std::vector<Label> join_regions(std::span<const double> areas,
                                std::span<const RegionBorder> borders, const JoinRule& rule);

}  // namespace superfacets
