#include "cells/turning.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "base/assert.hpp"
#include "base/buffer.hpp"

namespace superfacets {
namespace {

// Pairs of normals with at least this |cosine| are joined first, in the order of their places,
// which is fast, because most pairs are such and near in memory. cos(10 degrees).
constexpr double kSameDirection = 0.985;

// Disjoint sets of places (union-find) that know of each place whether its normal is to be turned
// over with respect to its root's.
class TurnedSets {
 public:
  explicit TurnedSets(std::size_t n_places) : parents_(n_places), turned_(n_places) {
    std::iota(parents_.begin(), parents_.end(), 0);
    std::fill(turned_.begin(), turned_.end(), std::uint8_t{0});
  }

  std::pair<Place, bool> root(Place place) {
    bool is_turned = false;
    while (parents_[place] != place) {
      const Place parent = parents_[place];
      turned_[place] ^= turned_[parent];  // halves the path for the next search
      parents_[place] = parents_[parent];
      is_turned ^= turned_[place] != 0;
      place = parents_[place];
    }
    return {place, is_turned};
  }

  // Joins two sets. `is_opposite`: one of the two normals has to be turned over.
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
  Buffer<std::uint8_t> turned_;  // with respect to the parent; 0 for a root
};

// A pair of neighbors whose normals differ.
struct Pair {
  double cost;  // 1 - |n_i . n_j|
  Cell lower;   // of the two points
  Cell higher;
  Place from;
  Place to;
};

bool operator<(const Pair& a, const Pair& b) {
  return std::tie(a.cost, a.lower, a.higher) < std::tie(b.cost, b.lower, b.higher);
}

// Joins neighbors along a minimum spanning tree (Kruskal).
TurnedSets join_neighbors(const NeighborRows& neighbors, std::span<const Cell> points,
                          std::span<const Point> normals) {
  const auto n_places = static_cast<Place>(points.size());
  TurnedSets sets(points.size());
  for (Place place = 0; place < n_places; ++place) {
    for (const Place near : neighbors.row(place)) {
      if (near == kNoPlace) continue;
      const double cosine = dot(normals[place], normals[near]);
      if (std::abs(cosine) >= kSameDirection) sets.unite(place, near, cosine < 0.0);
    }
  }
  std::vector<Pair> pairs;
  for (Place place = 0; place < n_places; ++place) {
    for (const Place near : neighbors.row(place)) {
      if (near == kNoPlace || sets.root(place).first == sets.root(near).first) continue;
      const double cosine = dot(normals[place], normals[near]);
      const auto [lower, higher] = std::minmax(points[place], points[near]);
      pairs.push_back({1.0 - std::abs(cosine), lower, higher, place, near});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  for (const Pair& pair : pairs) {
    sets.unite(pair.from, pair.to, dot(normals[pair.from], normals[pair.to]) < 0.0);
  }
  return sets;
}

}  // namespace

void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals) {
  const auto n_places = static_cast<Place>(points.size());
  SUPERFACETS_ASSERT(positions.size() == points.size() && areas.size() == points.size());
  SUPERFACETS_ASSERT(normals.size() == points.size());
  TurnedSets sets = join_neighbors(neighbors, points, normals);
  struct Sums {
    double area = 0.0;
    Point moment{0.0, 0.0, 0.0};  // area times position
    double volume = 0.0;          // three times the volume
  };
  std::vector<Sums> sums(points.size());  // by root
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
