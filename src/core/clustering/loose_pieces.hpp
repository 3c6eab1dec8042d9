// Stage 4a: makes every region connected.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// A cell is loose if it is not connected to the center of its region. Loose cells join neighboring
// regions, in rounds: each loose cell with a neighbor that is connected to a center takes the label
// of this neighbor. If there are several such neighbors, the shortest arc wins; ties go to the
// lowest label. Arcs of length `barrier` or more count only in rounds in which no loose cell can
// join over a shorter arc.
//
// Labels are by cell, `centers` by label; cells with kNoLabel are left out. Cells that no round
// reaches keep their labels. Time O(N + M), plus O(remaining loose cells and their arcs) per round.
Buffer<Label> join_loose_pieces(const Arcs& arcs, std::span<const float> lengths,
                                std::span<const Label> labels, std::span<const Cell> centers,
                                double barrier, ThreadTeam& team);

// join_loose_pieces on a part of a graph whose loose cells are already known. The part contains the
// loose cells in ascending order, with all of their arcs, and their neighbors.
Buffer<Label> join_loose_cells(const Arcs& arcs, std::span<const float> lengths,
                               std::span<const Label> labels, std::span<const Cell> loose,
                               double barrier);

}  // namespace superfacets
