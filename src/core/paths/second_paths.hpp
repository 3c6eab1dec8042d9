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

// For each place, the best path from a center other than its own, or kUnreached. `nearest` holds
// the best path to each place, with kNoLabel if unreached.
//
// Such a path consists of the best path to a place just outside the region, and a part inside the
// region: the place from which it last enters the region has its own center at least as near. So
// one expansion per region suffices, from its border inwards.
Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team);

}  // namespace superfacets
