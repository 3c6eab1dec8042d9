// How far cells are from the second-nearest center.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// The places of each label, ascending, by the label of their paths.
struct Regions {
  Regions(std::span<const Path> paths, Label n_regions);

  std::span<const Place> of(Label label) const {
    return std::span(places).subspan(starts[label], starts[label + 1] - starts[label]);
  }

  std::vector<std::int64_t> starts;  // (K + 1,)
  std::vector<Place> places;         // without those of kNoLabel
};

// For each place the best path from a center other than that of its label, where `nearest` holds
// the best of all paths (by place, kNoLabel where there is none). kUnreached where there is none.
//
// Up to the border of a region such a path is the best path to a place beyond the border: where it
// enters the region for the last time, it comes from a place whose own center is at least as near.
// From there on it stays in the region. So it takes one expansion within each region, from its
// border inwards.
Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team);

}  // namespace superfacets
