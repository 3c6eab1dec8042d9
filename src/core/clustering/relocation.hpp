// Between runs of the loop: centers leave where they are needed least for where most is to be won.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// The centers, by label, after some of them have moved. `nearest` is the exact classification by
// them, by place.
//
// To remove a center costs the sum of A (d2^2 - d1^2) over its region, with the measure A of a
// place and its path lengths to the nearest and the second-nearest center. The distortion of a
// region is the sum of A d1^2. The cheapest centers, at most n_moves of them and each cheaper than
// half the distortion that it is to divide, move to the farthest places of the most distorted
// regions. Among equals the lowest label comes first, and the lowest cell.
//
// No place loses its way: a center stays if any place of its region has no other, and so do the
// second-nearest centers of the region of one that moves. A region gets one center at most.
// Memory: 36 bytes per cell.
std::vector<Place> relocate_centers(const OrderedGraph& graph, std::span<const Path> nearest,
                                    std::span<const Place> centers, std::size_t n_moves,
                                    ThreadTeam& team);

}  // namespace superfacets
