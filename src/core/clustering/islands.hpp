// Cells that no center reaches: those of components without a seed, or out of reach of all centers.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// How unreached cells are labeled.
enum class Islands : std::uint8_t {
  kKeep,     // they become regions of their own
  kNearest,  // they get no label in the loop, and join the nearest region after it
};

struct JoinedIslands {
  Buffer<Label> labels;           // (N,) without kNoLabel
  Cell n_joined = 0;              // islands that joined a region
  std::vector<Cell> new_centers;  // the lowest cell of each island that became one
};

// Group of an island that may join any region.
inline constexpr Label kAnyGroup = -1;

// Labels each island, a connected piece of cells with kNoLabel, like the labeled cell nearest
// (Euclidean) to any cell of the island, the lowest among equals. Labels are indexed by cell; at
// least one must not be kNoLabel. Time O(N log N) in practice.
//
// With groups (equal for all cells of an island), an island joins only cells of its own group, or
// any if that is kAnyGroup. If there are none, it becomes a region: K and up, in the order of their
// lowest cells. Without groups (empty), an island joins any cell.
JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           std::span<const Label> groups, ThreadTeam& team);

}  // namespace superfacets
