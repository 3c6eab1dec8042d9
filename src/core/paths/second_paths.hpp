// Path lengths to the second-nearest center.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/lists.hpp"
#include "base/threads.hpp"
#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// The places of each label, ascending, by the label of their paths.
struct Regions {
  Regions(std::span<const Path> paths, Label n_regions);

  std::span<const Place> of(Label label) const { return places[label]; }

  Lists<Place> places;
};

// For each place the best path from a center other than its own, where `nearest` holds the best
// paths of all (by place, with kNoLabel if unreached). kUnreached if there is none.
//
// Such a path is the best path to a place just outside the region, followed by a part inside: where
// it enters the region for the last time, it comes from a place whose own center is at least as
// near. So one expansion within each region suffices, from its border inwards.
Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team);

}  // namespace superfacets
