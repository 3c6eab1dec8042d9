// Computes the path from each place to its second-nearest center.
#pragma once

#include "base/lists.hpp"
#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// The places grouped by the label of their path, ascending within each label.
struct Regions {
  Regions(std::span<const Path> paths, Label n_regions);

  std::span<const Place> of(Label label) const { return places[label]; }

  Lists<Place> places;
};

// For each place, the best path from a center other than its own, or kUnreached. `nearest` holds
// the best path to each place, with kNoLabel if unreached.
//
// The result consists of the best path to a place just outside the region, one arc into the region,
// and a part inside. (The place outside has its own center at least as near as any other.) So one
// expansion per region suffices, from its border inwards.
Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team);

}  // namespace superfacets
