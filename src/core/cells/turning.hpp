// Orients the normals of points consistently.
#pragma once

#include <tuple>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// The nearest neighbors of each place, in rows of equal length, padded with kNoPlace.
struct NeighborRows {
  std::span<const Place> places;  // (N * n_columns,)
  std::size_t n_columns;

  std::span<const Place> row(Place place) const {
    return places.subspan(n_columns * place, n_columns);
  }
};

// Disjoint sets of places (union-find) that store for each place whether its normal is flipped with
// respect to its root, the lowest place of the set. 5 bytes per place.
class TurnedSets {
 public:
  explicit TurnedSets(Place n_places);

  Place n_places() const { return static_cast<Place>(parents_.size()); }
  std::pair<Place, bool> root(Place place);

  // Joins two sets. `is_opposite`: one of the two normals must be flipped.
  void unite(Place a, Place b, bool is_opposite);

 private:
  Buffer<Place> parents_;
  Buffer<std::uint8_t> turned_;  // with respect to the parent; 0 for a root
};

// Two neighbors with different normals.
struct NormalPair {
  double cost;  // 1 - |n_i . n_j|
  Cell lower;   // of the two points
  Cell higher;
  Place from;
  Place to;
  bool is_opposite;  // whether their normals are opposite
};

// Consecutive places (a tile), and the neighbors of these outside the tile.
struct NormalTile {
  NeighborRows neighbors;          // of the tile; indices into the arrays below
  std::span<const Place> places;   // numbers among all places
  std::span<const Cell> points;    // numbers in the input; not needed by join_alike
  std::span<const Point> normals;  // of either sign
};

// The two steps of turn_consistently, tile by tile: first join all pairs with similar normals, tile
// after tile; then join the remaining pairs, in ascending order of (cost, lower, higher). Pairs are
// returned in that order.
void join_alike(TurnedSets& sets, const NormalTile& tile);
std::vector<NormalPair> pairs_apart(TurnedSets& sets, const NormalTile& tile);

// Flips normals so that neighbors agree, along a minimum spanning tree of each component by 1 -
// |n_i . n_j| (Hoppe et al. 1992), where pairs that differ by less than ten degrees have equal
// costs. Then flips all normals of a component if they enclose a negative volume. `points` are the
// numbers of the places in the input, which decide ties.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals);

}  // namespace superfacets
