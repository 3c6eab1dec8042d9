// Islands: cells that no center reaches, because their connected component has no seed, or because
// all centers are too far away.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// How unreached cells are labeled.
enum class Islands : std::uint8_t {
  kKeep,     // each island becomes one or more regions
  kNearest,  // islands have no label during the loop, and join the nearest region after the loop
};

struct JoinedIslands {
  Buffer<Label> labels;           // (N,) label of each cell, never kNoLabel
  Cell n_joined = 0;              // number of islands that joined a region
  std::vector<Cell> new_centers;  // lowest cell of each island that became a new region
};

// Group of an island that may join any region.
inline constexpr Label kAnyGroup = -1;

// Labels the islands. An island is a connected component of the cells with kNoLabel. Each island
// gets the label of the labeled cell with the smallest Euclidean distance from any cell of the
// island. If several labeled cells are equally near, the lowest is used. `labels` has one value per
// cell, in the order of the input, and at least one cell must have a label. Time O(N log N) in
// practice.
//
// `groups` is empty or contains the group of each cell, which must be the same for all cells of an
// island. If there are groups, an island can only join cells of its own group. An island of the
// group kAnyGroup can join any cell. An island whose group has no labeled cell becomes a new
// region. If there are K regions, new regions get the labels K, K + 1, ... in the order of their
// lowest cell indices.
JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           std::span<const Label> groups, ThreadTeam& team);

}  // namespace superfacets
