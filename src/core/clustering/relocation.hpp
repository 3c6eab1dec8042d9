// Relocation of centers between runs of the loop: moves centers from regions whose removal costs
// little to regions with a large distortion.
#pragma once

#include "paths/expansion.hpp"

namespace superfacets {

// Moves some centers, and returns the new center of each label. `nearest` contains the shortest
// path from the given centers to each cell.
//
// The cost of removing a center is the sum of A (d2^2 - d1^2) over its region, where A is the
// measure of a cell, and d1 and d2 are its path lengths to the nearest and the second-nearest
// center. The distortion of a region is the sum of A d1^2. In both sums, path lengths are limited
// to four times the mean path length, unless the graph has a finite crease limit. Up to n_moves
// centers with the lowest removal costs move to the farthest cells of the regions with the largest
// distortion. A center moves only if its removal cost is less than half the distortion of the
// region that it will divide (a quarter if the graph has a finite crease limit). Regions with equal
// costs or equal distortions are ordered by label. Of equally far cells, the lowest is used.
//
// Every cell must keep a path to some center. Therefore a center does not move if a cell of its
// region has no second-nearest center, or if the center is second-nearest for a cell of a region
// whose center moves. A region gets at most one new center. Uses 36 bytes per cell.
std::vector<Place> relocate_centers(const OrderedGraph& graph, std::span<const Path> nearest,
                                    std::span<const Place> centers, std::size_t n_moves,
                                    ThreadTeam& team);

}  // namespace superfacets
