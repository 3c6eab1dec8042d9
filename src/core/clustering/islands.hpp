// Cells that no center reaches: those of components without a seed, or out of reach of all centers.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// How they are labeled.
enum class Islands : std::uint8_t {
  kKeep,     // they become regions of their own
  kNearest,  // they get no label in the loop, and join the nearest region after it
};

struct JoinedIslands {
  Buffer<Label> labels;  // (N,) without kNoLabel
  Cell n_islands = 0;
};

// Labels each island, a connected piece of cells with kNoLabel, like the labeled cell nearest
// (Euclidean) to any cell of the island, the lowest among equals. Labels are indexed by cell; at
// least one must not be kNoLabel. Time O(N log N) in practice.
JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team);

}  // namespace superfacets
