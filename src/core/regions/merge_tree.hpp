// Stage 5: merges neighboring regions pair by pair, and records the tree of merges.
#pragma once

#include "base/types.hpp"

namespace superfacets {

// The border between two neighbors. The cost of a border (see BorderCost) is lower along a crease.
// A length of 0 means that a gap separates the two neighbors.
struct MergeBorder {
  Label low;
  Label high;  // > low
  double length;
  double cost;  // 0 to length
};

// K regions to be merged.
struct MergeRegions {
  std::span<const double> areas;     // (K,) or volumes
  std::span<const Point> positions;  // (K,) mean position of the cells of each region
  // (K, F) mean features of the cells of each region, row by row; or empty
  std::span<const double> features;
  std::span<const MergeBorder> borders;  // sorted, each pair once
};

struct MergeRule {
  // distance that is added for a border entirely in a crease, as a multiple of r
  double crease_weight = 0.0;
  int dimension = 2;  // 2: areas; 3: volumes
};

struct MergeTree {
  std::vector<Label> children;  // (M, 2) the two nodes of each merge, the lower first
  std::vector<double> costs;    // (M,)
};

// Repeatedly merges the pair of neighbors with the lowest cost, until no neighbors are left. This
// gives M = K - (number of components) merges. Regions are nodes 0 to K-1, and merge m makes node K
// + m. The cost of a pair is
//
//   a b / (a + b) * (|p - q| + crease_weight * r * (1 - cost / length)) / length
//
// for areas a and b, positions p and q, and the radius r of a disk (or a ball) of their total area.
// The cost is low for small, near regions with a long common border outside creases. A gap counts
// as a border of length r (of area r^2 in a volume) with border cost 0. If regions have features f
// and g, the cost is Ward's, a b / (a + b) * |f - g|^2, and the cost in the formula only breaks
// ties. Remaining ties go to the lower nodes. Means of two nodes are weighted by area (equally if
// both areas are 0), and borders are added.
//
// Merging two regions with m neighbors in total takes O(m log K) time. Memory: O(K + borders).
MergeTree merge_tree(const MergeRegions& regions, const MergeRule& rule);

}  // namespace superfacets
