// Stage 4a: makes every region connected.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// A cell is loose if its region does not connect it to the center of the region. Loose cells join
// neighboring regions, in rounds. In a round, a loose cell takes the label of a neighbor that is
// connected to a center. If there are several such neighbors, the shortest arc wins; ties go to the
// lowest label. A round uses arcs of length `barrier` or more only if no loose cell can join over a
// shorter arc.
//
// `labels` is indexed by cell, `centers` by label. Cells with kNoLabel, and cells that no round
// reaches, keep their labels. Time O(N + M), plus O(remaining loose cells and their arcs) per
// round.
Buffer<Label> join_loose_pieces(const Arcs& arcs, std::span<const float> lengths,
                                std::span<const Label> labels, std::span<const Cell> centers,
                                double barrier, ThreadTeam& team);

// Like join_loose_pieces, for a part of a graph whose loose cells are known. The part contains the
// loose cells in ascending order, all of their arcs, and their neighbors.
Buffer<Label> join_loose_cells(const Arcs& arcs, std::span<const float> lengths,
                               std::span<const Label> labels, std::span<const Cell> loose,
                               double barrier);

}  // namespace superfacets
