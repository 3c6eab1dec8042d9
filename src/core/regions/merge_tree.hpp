// Stage 5: merges neighboring regions pair by pair, and records the tree of merges.
#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"

namespace superfacets {

// The border of two neighbors: its length, and its cost, which is lower in a crease
// (regions/borders). A length of 0 stands for a gap between them.
struct MergeBorder {
  Label low;
  Label high;  // > low
  double length;
  double cost;  // 0 to length
};

// K regions to be merged.
struct MergeRegions {
  std::span<const double> areas;         // (K,) or volumes
  std::span<const Point> positions;      // (K,) means over their cells
  std::span<const double> features;      // (K, F) means over their cells, row by row; or empty
  std::span<const MergeBorder> borders;  // sorted, each pair once
};

struct MergeRule {
  double crease_weight = 0.0;  // length that a border entirely in a crease adds, in radii
  int dimension = 2;           // 2: areas; 3: volumes
};

struct MergeTree {
  std::vector<Label> children;  // (M, 2) the two nodes of each merge, the lower first
  std::vector<double> costs;    // (M,)
};

// Merges the pair of neighbors with the lowest cost until none is left: M = K - the number of
// components. Regions are nodes 0 to K-1, merge m makes node K + m. The cost of a pair is
//
//   a b / (a + b) * (|p - q| + crease_weight * r * (1 - cost / length)) / length
//
// for areas a and b, positions p and q, and the radius r of a disk (or a ball) of their total area:
// it is low for small, near regions with a long common border outside creases. A gap counts as a
// border of length r (of area r^2) with cost 0. With features f and g the cost is a b / (a + b) *
// |f - g|^2 (Ward), and the cost above breaks ties. Remaining ties go to the lower nodes. Means of
// two nodes are weighted by area (equally if both areas are 0), and borders are added.
//
// Merging regions with m neighbors in all takes O(m log K) time; memory is O(K + borders).
MergeTree merge_tree(const MergeRegions& regions, const MergeRule& rule);

}  // namespace superfacets
