// Relocation, between runs of the loop: centers move from where they are needed least to where they
// gain most.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// The centers, by label, after some have moved. `nearest` is the exact classification by the given
// centers, by place.
//
// The cost of removing a center is the sum of A (d2^2 - d1^2) over its region, with the measure A
// of a place and its path lengths to the nearest and the second-nearest center. The distortion of a
// region is the sum of A d1^2. The cheapest centers, at most n_moves, each cheaper than half (a
// quarter, if the graph has barriers) the distortion of the region that it will divide, move to the
// farthest places of the most distorted regions. The lowest labels and cells win ties.
//
// Every place keeps a path to a center: a center stays if any place of its region has no other, and
// so do the second-nearest centers of a region whose center moves. A region gets at most one new
// center. Memory: 36 bytes per cell.
std::vector<Place> relocate_centers(const OrderedGraph& graph, std::span<const Path> nearest,
                                    std::span<const Place> centers, std::size_t n_moves,
                                    ThreadTeam& team);

}  // namespace superfacets
