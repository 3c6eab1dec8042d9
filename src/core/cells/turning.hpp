// Orients the normals of points consistently.
#pragma once

#include <tuple>

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

// Disjoint sets of places (union-find). Each place also stores whether its normal is flipped
// relative to the root, the lowest place of the set. Takes 5 bytes per place.
class TurnedSets {
 public:
  explicit TurnedSets(Place n_places);

  Place n_places() const { return static_cast<Place>(parents_.size()); }
  std::pair<Place, bool> root(Place place);

  // Joins the sets of a and b. If `is_opposite`, one of the two normals must be flipped.
  void unite(Place a, Place b, bool is_opposite);

 private:
  Buffer<Place> parents_;
  Buffer<std::uint8_t> turned_;  // 1: flipped relative to the parent; 0 for a root
};

// Two neighbors whose normals differ by more than 10 degrees.
struct NormalPair {
  double cost;  // 1 - |n_i . n_j|
  Cell lower;   // lower index of the two points
  Cell higher;
  Place from;
  Place to;
  bool is_opposite;  // whether their normals are opposite
};

// A tile: consecutive places, and their neighbors outside the tile.
struct NormalTile {
  NeighborRows neighbors;  // neighbors of the places of the tile, as indices into the arrays below
  std::span<const Place> places;   // index of each among all places
  std::span<const Cell> points;    // index of each in the input; not needed by join_alike
  std::span<const Point> normals;  // unit normals of either sign
};

// These two functions do the work of turn_consistently tile by tile. First, join_alike joins all
// pairs with similar normals, for one tile after another. Second, pairs_apart returns the remaining
// pairs of a tile, in ascending order of (cost, lower, higher). The caller must join the pairs of
// all tiles in this order.
void join_alike(TurnedSets& sets, const NormalTile& tile);
std::vector<NormalPair> pairs_apart(TurnedSets& sets, const NormalTile& tile);

// Flips normals so that neighbors agree, along a minimum spanning tree of each connected component
// with the cost 1 - |n_i . n_j| (Hoppe et al. 1992). Pairs that differ by less than ten degrees
// have equal costs. Then flips all normals of a component if the component encloses a negative
// volume. `points` holds the index of each place in the input, which decides ties.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals);

}  // namespace superfacets
