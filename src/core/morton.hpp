// A space-filling curve: cells that are near in the order are near in space.
#pragma once

#include "types.hpp"

namespace superfacets {

// Cells sorted along a Morton curve of 2^10 steps an axis over their bounding box; cells on the
// same step keep the order of their indices. Time O(N).
std::vector<Cell> morton_order(std::span<const Point> positions);

}  // namespace superfacets
