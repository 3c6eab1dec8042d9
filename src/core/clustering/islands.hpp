// Cells that no center reaches: those of components without a seed, or out of reach of all centers.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// What becomes of them.
enum class Islands : std::uint8_t {
  kKeep,     // they become regions of their own
  kNearest,  // they have no label in the loop, and join the nearest region after it
};

struct JoinedIslands {
  Buffer<Label> labels;  // (N,) without kNoLabel
  Cell n_islands = 0;
};

// Gives each island, a connected piece of cells with kNoLabel, the label of the cell nearest
// (Euclidean) to any of its own, of those that have one, the lowest among equals. Labels are by
// cell; not all may be kNoLabel. Time O(N log N) in practice.
JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team);

}  // namespace superfacets
