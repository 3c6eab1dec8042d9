// Stage 5: merges neighboring regions pair by pair, and returns the tree of merges (dendrogram).
#pragma once

#include "base/types.hpp"

namespace superfacets {

// The border between two neighboring regions. The cost of a border (see BorderCosts) is lower along
// a crease. If the length is 0, the two regions are separated by a gap.
struct MergeBorder {
  Label low;
  Label high;     // higher label than `low`
  double length;  // length of the border
  double cost;    // sum of the border costs of its arcs, 0 to `length`
};

// The K regions to be merged.
struct MergeRegions {
  std::span<const double> areas;     // (K,) area or volume of each region
  std::span<const Point> positions;  // (K,) mean position of the cells of each region
  // (K, F) mean features of the cells of each region, row by row; or empty
  std::span<const double> features;
  std::span<const MergeBorder> borders;  // sorted by (low, high), without duplicates
};

struct MergeRule {
  // weight of creases: distance added for a border along a crease, as a multiple of the radius r
  double crease_weight = 0.0;
  int dimension = 2;  // 2 if `areas` are areas, 3 if they are volumes
};

struct MergeTree {
  std::vector<Label> children;  // (M, 2) the two nodes of each merge, the lower first
  std::vector<double> costs;    // (M,) cost of each merge
};

// Repeatedly merges the pair of neighbors with the lowest cost, until no neighbors are left. This
// gives M = K - (number of components) merges. Regions are the nodes 0 to K-1, and merge m creates
// the node K + m. The cost of a pair is
//
//   a b / (a + b) * (|p - q| + crease_weight * r * (1 - cost / length)) / length
//
// for areas a and b, positions p and q, and the radius r of a disk (or a ball) of their total area.
// The cost is low for small, near regions with a long common border outside creases. A gap is
// treated as a border with length r (area r^2 in a volume) and border cost 0. If regions have
// features f and g, the cost is Ward's cost, a b / (a + b) * |f - g|^2, and pairs with equal costs
// are ordered by the formula above. If this is equal too, pairs are ordered by their nodes. When
// two nodes are merged, means are weighted by area (equally if both areas are 0), and borders are
// added.
//
// A merge of two regions with m neighbors in total takes O(m log K) time. Memory is O(K + number of
// borders).
MergeTree merge_tree(const MergeRegions& regions, const MergeRule& rule);

}  // namespace superfacets
