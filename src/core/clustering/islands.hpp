// Islands: cells that no center reaches, because their connected component has no seed, or because
// all centers are too far away.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// How unreached cells are labeled.
enum class Islands : std::uint8_t {
  kKeep,     // each island becomes a region
  kNearest,  // islands have no label during the loop, and join the nearest region after it
};

struct JoinedIslands {
  Buffer<Label> labels;           // (N,) without kNoLabel
  Cell n_joined = 0;              // number of islands that joined a region
  std::vector<Cell> new_centers;  // lowest cell of each island that became a region
};

// Group of an island that may join any region.
inline constexpr Label kAnyGroup = -1;

// An island is a connected component of the cells with kNoLabel. Each island gets the label of the
// labeled cell with the least Euclidean distance from any cell of the island. Ties go to the lowest
// labeled cell. `labels` is indexed by cell, and at least one cell must have a label. Time O(N log
// N) in practice.
//
// `groups` is empty, or holds the group of each cell, which is the same for all cells of an island.
// With groups, an island joins only cells of its own group; an island of kAnyGroup joins any cell.
// An island whose group has no labeled cell becomes a region. These regions get labels from K on,
// in the order of their lowest cells.
JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           std::span<const Label> groups, ThreadTeam& team);

}  // namespace superfacets
