// Normals of points that agree with each other.
#pragma once

#include <tuple>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

inline constexpr Place kNoPlace = -1;

// The nearest neighbors of each place; rows of the same length, which kNoPlace fills up.
struct NeighborRows {
  std::span<const Place> places;  // (N * n_columns,)
  std::size_t n_columns;

  std::span<const Place> row(Place place) const {
    return places.subspan(n_columns * place, n_columns);
  }
};

// Disjoint sets of places (union-find) that know of each place whether its normal is to be turned
// over with respect to its root's, which is the lowest place. 5 bytes a place.
class TurnedSets {
 public:
  explicit TurnedSets(Place n_places);

  Place n_places() const { return static_cast<Place>(parents_.size()); }
  std::pair<Place, bool> root(Place place);

  // Joins two sets. `is_opposite`: one of the two normals has to be turned over.
  void unite(Place a, Place b, bool is_opposite);

 private:
  Buffer<Place> parents_;
  Buffer<std::uint8_t> turned_;  // with respect to the parent; 0 for a root
};

// A pair of neighbors whose normals differ.
struct NormalPair {
  double cost;  // 1 - |n_i . n_j|
  Cell lower;   // of the two points
  Cell higher;
  Place from;
  Place to;
  bool is_opposite;  // their normals are
};

// The order in which they are joined.
inline bool operator<(const NormalPair& a, const NormalPair& b) {
  return std::tie(a.cost, a.lower, a.higher) < std::tie(b.cost, b.lower, b.higher);
}

// Some of the places in a row, and the others that are neighbors of theirs.
struct NormalTile {
  NeighborRows neighbors;          // of those in a row; indices into what follows
  std::span<const Place> places;   // among all
  std::span<const Cell> points;    // numbers in the input; not needed by join_alike
  std::span<const Point> normals;  // of either sign
};

// The two steps of turn_consistently, tile by tile: first all pairs that differ by little are
// joined, tile after tile; then those of the pairs left are, in rising order of (cost, lower,
// higher). Pairs are returned in that order.
void join_alike(TurnedSets& sets, const NormalTile& tile);
std::vector<NormalPair> pairs_apart(TurnedSets& sets, const NormalTile& tile);

// Turns normals over so that those of neighbors agree: along a minimum spanning tree of each
// component of the neighbors, by 1 - |n_i . n_j| (Hoppe et al. 1992), where pairs that differ by
// less than ten degrees count as equal. Then all normals of a component are turned over if they
// enclose a negative volume. `points` are the places' numbers in the input, which decide ties.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals);

}  // namespace superfacets
