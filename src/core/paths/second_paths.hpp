// Computes for each cell the path from its second-nearest center.
#pragma once

#include "base/lists.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Lists the cells of each region in ascending order. A region consists of all cells whose path has
// the same label.
Lists<Place> regions_of(std::span<const Path> paths, Label n_regions);

// Returns for each cell the best path from any center except the center of its region. The length
// is kUnreached if there is no such path. `nearest` contains the best path to each cell; its label
// is kNoLabel if the cell is unreached.
//
// Such a path consists of the best path to a neighboring cell outside the region, one arc into the
// region, and a part inside the region. So one expansion per region suffices, from its border
// inwards.
Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Lists<Place>& regions, ThreadTeam& team);

}  // namespace superfacets
