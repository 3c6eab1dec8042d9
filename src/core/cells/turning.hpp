// Orients the normals of points consistently.
#pragma once

#include <tuple>

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// The nearest neighbors of each point, in rows of equal length, padded with kNoPlace.
struct NeighborRows {
  std::span<const Place> places;  // (N * n_columns,) sorted index of each neighbor
  std::size_t n_columns;          // number of entries per row

  std::span<const Place> row(Place place) const {
    return places.subspan(n_columns * place, n_columns);
  }
};

// Disjoint sets of points (union-find). Each point also stores whether its normal is flipped
// relative to the normal of its parent. The root is the lowest point of the set. Uses 5 bytes per
// point.
class TurnedSets {
 public:
  explicit TurnedSets(Place n_places);

  Place n_places() const { return static_cast<Place>(parents_.size()); }
  std::pair<Place, bool> root(Place place);

  // Joins the sets of a and b. If `is_opposite`, one of the two normals must be flipped.
  void unite(Place a, Place b, bool is_opposite);

 private:
  Buffer<Place> parents_;
  Buffer<std::uint8_t> turned_;  // 1 if flipped relative to the parent; 0 for a root
};

// Two neighbors whose normals differ by more than 10 degrees, even if one of them is flipped.
struct NormalPair {
  double cost;       // 1 - |n_i . n_j|
  Cell lower;        // the lower of the two input indices
  Cell higher;       // the higher of the two input indices
  Place from;        // sorted index of one point
  Place to;          // sorted index of the other point
  bool is_opposite;  // whether the dot product of the normals is negative
};

// A tile: points with consecutive sorted indices, followed by their neighbors outside the tile.
struct NormalTile {
  NeighborRows neighbors;          // neighbors of each point, as indices into the next arrays
  std::span<const Place> places;   // sorted index of each point of the whole cloud
  std::span<const Cell> points;    // input index of each point; not needed by join_alike
  std::span<const Point> normals;  // unit normal of each point, with arbitrary sign
};

// join_alike and pairs_apart do the work of turn_consistently tile by tile. First, join_alike joins
// all pairs with similar normals, for one tile after another. Second, pairs_apart returns the
// remaining pairs of a tile, in ascending order of (cost, lower, higher). The caller must join the
// pairs of all tiles in this order.
void join_alike(TurnedSets& sets, const NormalTile& tile);
std::vector<NormalPair> pairs_apart(TurnedSets& sets, const NormalTile& tile);

// Flips normals so that neighbors agree. Neighbors are compared along a minimum spanning tree of
// each connected component, with the cost 1 - |n_i . n_j| (Hoppe et al. 1992). Pairs of normals
// that differ by less than ten degrees are joined first. Then flips all normals of a component if
// the component encloses a negative volume. `points` contains the input index of each point, which
// decides between pairs of equal cost.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals);

}  // namespace superfacets
