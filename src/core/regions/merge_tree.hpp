// Stage 5: pairs of neighboring regions that merge one after the other, and the tree of them all.
#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"

namespace superfacets {

// What neighbors share: the length of their border, and its cost, which a crease makes less
// (regions/borders). A length of 0 stands for a gap between them.
struct MergeBorder {
  Label low;
  Label high;  // > low
  double length;
  double cost;  // 0 to length
};

// K regions that are to merge.
struct MergeRegions {
  std::span<const double> areas;         // (K,) or volumes
  std::span<const Point> positions;      // (K,) means over their cells
  std::span<const double> features;      // (K, F) means over their cells, row by row; or empty
  std::span<const MergeBorder> borders;  // sorted, each pair once
};

struct MergeRule {
  double crease_weight = 0.0;  // what a border all in a crease costs, in radii
  int dimension = 2;           // of areas; 3 of volumes
};

struct MergeTree {
  std::vector<Label> children;  // (M, 2) the nodes that each merge joins, the lower first
  std::vector<double> costs;    // (M,)
};

// Merges the pair of neighbors with the least cost until none is left: M = K - the number of
// components. Regions are nodes 0 to K-1, merge m makes node K + m. The cost of a pair is
//
//   a b / (a + b) * (|p - q| + crease_weight * r * (1 - cost / length)) / length
//
// for areas a and b, positions p and q, and the radius r of a disk (or a ball) of their area
// together: small regions, near each other, with a long border between them that is in no crease.
// A gap counts as a border of length r (of area r^2) with cost 0. With features f and g the cost is
// a b / (a + b) * |f - g|^2 (Ward), and the cost above decides between pairs for which that is the
// same.
// Pairs that are equal in all come in the order of their nodes, lower ones first. Means are
// weighted by area (halves where there is none), and borders are added.
//
// A merge of regions with m neighbors in all takes O(m log K) time; memory is O(K + borders).
MergeTree merge_tree(const MergeRegions& regions, const MergeRule& rule);

}  // namespace superfacets
