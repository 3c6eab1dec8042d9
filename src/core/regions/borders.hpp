// Stage 5: which regions touch, and for how long.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// What a border through an edge costs: |e| exp(-excess / crease_scale), where excess is by how much
// the weight of the arc is more than the distance between the centroids across the edge (eq. 1):
// what the crease adds to it. In the unit of the vertices.
struct BorderCost {
  double diagonal = 1.0;  // d, the unit of the weights
  double crease_scale = 1.0;

  double operator()(const ArcGeometry& arcs, std::span<const double> weights, Face from,
                    std::int64_t arc) const;
};

struct RegionBorder {
  Label low;
  Label high;   // > low
  double cost;  // summed over the arcs from one to the other
};

// The borders between regions, sorted. Time O(F + M), and O(n log n) for n arcs that cross borders;
// the same bits on any number of threads.
std::vector<RegionBorder> region_borders(const ArcGeometry& arcs, std::span<const double> weights,
                                         std::span<const Label> labels, const BorderCost& cost,
                                         ThreadTeam& team);

// The nearest cell (Euclidean, the lowest of equals) to each of some cells, of those wanted. At
// least one has to be.
std::vector<Cell> nearest_wanted(const OrderedGraph& graph, std::span<const Cell> cells,
                                 std::span<const std::uint8_t> is_wanted);

}  // namespace superfacets
