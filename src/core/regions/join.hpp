// Stage 5: regions that join neighbors.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "regions/borders.hpp"

namespace superfacets {

// Which regions have to join another.
struct JoinRule {
  std::span<const std::uint8_t> stays;  // (K,) 1: never; empty: none of them
  double least_area = 0.0;              // else those with less area than this, at the time
};

// Joins regions to neighbors, the smallest first (the lowest label of equals), each to the one it
// shares most border with, and returns the region that each ends in, (K,). Areas and borders of
// what has been joined add up. Of borders that cost the same, the one to the lowest label counts
// (where regions have been joined, to that of the one with most neighbors). A region without a
// neighbor stays. `borders` as from region_borders.
//
// Time O((K + B) log^2 B) for B borders: of two regions that join, the borders of the one with
// fewer neighbors are handed over.
std::vector<Label> join_regions(std::span<const double> areas,
                                std::span<const RegionBorder> borders, const JoinRule& rule);

// The nearest cell (Euclidean, the lowest of equals) to each of some cells, of those wanted. At
// least one has to be.
std::vector<Cell> nearest_wanted(const OrderedGraph& graph, std::span<const Cell> cells,
                                 std::span<const std::uint8_t> is_wanted);

}  // namespace superfacets
