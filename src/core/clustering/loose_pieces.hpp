// Stage 4a: regions made one piece each.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Gives the cells of a region that are not connected with its center to neighboring regions. In
// each of several rounds, every such cell with a neighbor that is connected with a center takes the
// label of that neighbor; of several, that of the shortest arc, and the lowest label among equals.
// Arcs of length `barrier` or more count only in rounds in which no cell has another.
//
// Labels are by cell, `centers` by label; cells with kNoLabel are left out. Cells that no round
// reaches keep their labels. Time O(N + M), and for each round that of the cells that are left.
Buffer<Label> join_loose_pieces(const Arcs& arcs, std::span<const float> lengths,
                                std::span<const Label> labels, std::span<const Cell> centers,
                                double barrier);

// The same for part of a graph, where it is known which cells are not connected with a center: the
// part has these loose cells, in ascending order, with all of their arcs, and their neighbors.
Buffer<Label> join_loose_cells(const Arcs& arcs, std::span<const float> lengths,
                               std::span<const Label> labels, std::span<const Cell> loose,
                               double barrier);

}  // namespace superfacets
