#include "cells/turning.hpp"

#include <numeric>
#include <tuple>

namespace superfacets {
namespace {

// Cosine of 10 degrees. Pairs of normals with at least this |cosine| are joined first, in the order
// of the rows. Most pairs are similar, and this order is fast because neighbors are near in memory.
constexpr double kSameDirection = 0.985;

// Calls take(row, near, cosine) for each pair of neighbors, row by row.
template <typename Take>
void for_each_cosine(const NeighborRows& neighbors, std::span<const Point> normals,
                     const Take& take) {
  const auto n_rows = static_cast<Place>(neighbors.places.size() / neighbors.n_columns);
  for (Place row = 0; row < n_rows; ++row) {
    for (const Place near : neighbors.row(row)) {
      if (near != kNoPlace) take(row, near, dot(normals[row], normals[near]));
    }
  }
}

// Disjoint sets of points (union-find). Each point also stores whether its normal is flipped
// relative to the normal of its parent. The root is the lowest point of the set. Uses 5 bytes per
// point.
class TurnedSets {
 public:
  explicit TurnedSets(Place n_places) : parents_(n_places), turned_(n_places) {
    std::iota(parents_.begin(), parents_.end(), 0);
    std::ranges::fill(turned_, std::uint8_t{0});
  }

  std::pair<Place, bool> root(Place place) {
    bool is_turned = false;
    while (parents_[place] != place) {
      const Place parent = parents_[place];
      turned_[place] ^= turned_[parent];  // path halving, for faster searches
      parents_[place] = parents_[parent];
      is_turned ^= turned_[place] != 0;
      place = parents_[place];
    }
    return {place, is_turned};
  }

  // Joins the sets of a and b. If `is_opposite`, one of the two normals must be flipped.
  void unite(Place a, Place b, bool is_opposite) {
    const auto [root_a, a_turned] = root(a);
    const auto [root_b, b_turned] = root(b);
    if (root_a == root_b) return;
    const auto [low, high] = std::minmax(root_a, root_b);
    parents_[high] = low;
    turned_[high] = static_cast<std::uint8_t>(a_turned ^ b_turned ^ is_opposite);
  }

 private:
  Buffer<Place> parents_;
  Buffer<std::uint8_t> turned_;  // 1 if flipped relative to the parent; 0 for a root
};

// Two neighbors whose normals differ by more than 10 degrees, even if one of them is flipped.
struct NormalPair {
  double cost;       // 1 - |n_i . n_j|
  Place from;        // one point
  Place to;          // the other point
  bool is_opposite;  // whether the dot product of the normals is negative
};

// Joins neighbors along a minimum spanning tree (Kruskal). Pairs of similar normals come first.
TurnedSets join_neighbors(const NeighborRows& neighbors, std::span<const Point> normals) {
  TurnedSets sets(static_cast<Place>(normals.size()));
  for_each_cosine(neighbors, normals, [&](Place from, Place to, double cosine) {
    if (std::abs(cosine) >= kSameDirection) sets.unite(from, to, cosine < 0.0);
  });
  std::vector<NormalPair> pairs;
  for_each_cosine(neighbors, normals, [&](Place from, Place to, double cosine) {
    if (std::abs(cosine) >= kSameDirection) return;
    if (sets.root(from).first == sets.root(to).first) return;
    pairs.push_back({1.0 - std::abs(cosine), from, to, cosine < 0.0});
  });
  std::ranges::sort(pairs, {}, [](const NormalPair& pair) {
    const auto [lower, higher] = std::minmax(pair.from, pair.to);
    return std::tuple(pair.cost, lower, higher);
  });
  for (const NormalPair& pair : pairs) sets.unite(pair.from, pair.to, pair.is_opposite);
  return sets;
}

}  // namespace

void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<Point> normals) {
  const auto n_places = static_cast<Place>(normals.size());
  SUPERFACETS_ASSERT(positions.size() == normals.size() && areas.size() == normals.size());
  TurnedSets sets = join_neighbors(neighbors, normals);
  struct Sums {
    double area = 0.0;
    Point moment{0.0, 0.0, 0.0};  // sum of area times position
    double volume = 0.0;          // three times the enclosed volume
  };
  std::vector<Sums> sums(normals.size());  // sums of each set, stored at the index of its root
  for (Place place = 0; place < n_places; ++place) {
    const auto [root, is_turned] = sets.root(place);
    if (is_turned) normals[place] = -1.0 * normals[place];
    sums[root].area += areas[place];
    sums[root].moment = sums[root].moment + areas[place] * positions[place];
  }
  for (Place place = 0; place < n_places; ++place) {
    Sums& sum = sums[sets.root(place).first];
    if (!(sum.area > 0.0)) continue;
    const Point center = (1.0 / sum.area) * sum.moment;
    sum.volume += areas[place] * dot(normals[place], positions[place] - center);
  }
  for (Place place = 0; place < n_places; ++place) {
    if (sums[sets.root(place).first].volume < 0.0) normals[place] = -1.0 * normals[place];
  }
}

}  // namespace superfacets
