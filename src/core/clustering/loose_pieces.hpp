// Stage 4a: makes every region connected.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// A cell is loose if no path within its region connects it to the center of the region. Loose cells
// join neighboring regions, in rounds. In a round, a loose cell takes the label of a neighbor that
// is connected to a center. If there are several such neighbors, the neighbor with the shortest arc
// is used; if arcs are equally long, the neighbor with the lowest label. A round uses arcs of
// length `crease_limit` or more only if no loose cell has a shorter arc to a connected neighbor.
//
// `labels` has one value per cell, and `centers` one cell per label. Cells with kNoLabel, and loose
// cells without a path to another region, keep their labels. Time O(N + M), plus the number of
// remaining loose cells and their arcs in each round.
Buffer<Label> join_loose_pieces(const Arcs& arcs, std::span<const float> lengths,
                                std::span<const Label> labels, std::span<const Cell> centers,
                                double crease_limit, ThreadTeam& team);

}  // namespace superfacets
