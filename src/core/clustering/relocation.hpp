// Relocation between runs of the loop: moves centers from regions that lose little without them to
// regions that gain much from a second center.
#pragma once

#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Moves some centers, and returns the center of each label. `nearest` holds, for each place, its
// path in the exact classification by the given centers.
//
// The cost of removing a center is the sum of A (d2^2 - d1^2) over its region, where A is the
// measure of a place, and d1 and d2 are its path lengths to the nearest and the second-nearest
// center. The distortion of a region is the sum of A d1^2. Up to n_moves centers with the lowest
// removal costs move to the farthest places of the regions with the largest distortion. A center
// moves only if its removal costs less than half the distortion of the region that it will divide
// (a quarter, if the graph has barriers). Ties go to the lowest label or cell.
//
// Every place must keep a path to some center. Therefore a center stays in two cases: a place of
// its region has no second-nearest center, or the center is second-nearest for a place of a region
// whose center moves. A region gets at most one new center. Memory: 36 bytes per cell.
std::vector<Place> relocate_centers(const OrderedGraph& graph, std::span<const Path> nearest,
                                    std::span<const Place> centers, std::size_t n_moves,
                                    ThreadTeam& team);

}  // namespace superfacets
