#include "cells/turning.hpp"

#include <numeric>

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

template <typename PlaceOf>
void unite_alike(TurnedSets& sets, const NeighborRows& neighbors, std::span<const Point> normals,
                 const PlaceOf& place_of) {
  for_each_cosine(neighbors, normals, [&](Place row, Place near, double cosine) {
    if (std::abs(cosine) < kSameDirection) return;
    sets.unite(place_of(row), place_of(near), cosine < 0.0);
  });
}

template <typename PlaceOf>
std::vector<NormalPair> list_pairs(TurnedSets& sets, const NeighborRows& neighbors,
                                   std::span<const Cell> points, std::span<const Point> normals,
                                   const PlaceOf& place_of) {
  std::vector<NormalPair> pairs;
  for_each_cosine(neighbors, normals, [&](Place row, Place near, double cosine) {
    if (std::abs(cosine) >= kSameDirection) return;  // similar pairs have already been joined
    const Place from = place_of(row);
    const Place to = place_of(near);
    if (sets.root(from).first == sets.root(to).first) return;
    const auto [lower, higher] = std::minmax(points[row], points[near]);
    pairs.push_back({1.0 - std::abs(cosine), lower, higher, from, to, cosine < 0.0});
  });
  std::ranges::sort(pairs, {}, [](const NormalPair& pair) {
    return std::tuple(pair.cost, pair.lower, pair.higher);
  });
  return pairs;
}

// Joins neighbors along a minimum spanning tree (Kruskal).
TurnedSets join_neighbors(const NeighborRows& neighbors, std::span<const Cell> points,
                          std::span<const Point> normals) {
  const auto same = [](Place place) { return place; };
  TurnedSets sets(static_cast<Place>(points.size()));
  unite_alike(sets, neighbors, normals, same);
  for (const NormalPair& pair : list_pairs(sets, neighbors, points, normals, same)) {
    sets.unite(pair.from, pair.to, pair.is_opposite);
  }
  return sets;
}

}  // namespace

TurnedSets::TurnedSets(Place n_places) : parents_(n_places), turned_(n_places) {
  std::iota(parents_.begin(), parents_.end(), 0);
  std::ranges::fill(turned_, std::uint8_t{0});
}

std::pair<Place, bool> TurnedSets::root(Place place) {
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

void TurnedSets::unite(Place a, Place b, bool is_opposite) {
  const auto [root_a, a_turned] = root(a);
  const auto [root_b, b_turned] = root(b);
  if (root_a == root_b) return;
  const auto [low, high] = std::minmax(root_a, root_b);
  parents_[high] = low;
  turned_[high] = static_cast<std::uint8_t>(a_turned ^ b_turned ^ is_opposite);
}

void join_alike(TurnedSets& sets, const NormalTile& tile) {
  unite_alike(sets, tile.neighbors, tile.normals, [&](Place row) { return tile.places[row]; });
}

std::vector<NormalPair> pairs_apart(TurnedSets& sets, const NormalTile& tile) {
  return list_pairs(sets, tile.neighbors, tile.points, tile.normals,
                    [&](Place row) { return tile.places[row]; });
}

void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<const Cell> points,
                       std::span<Point> normals) {
  const auto n_places = static_cast<Place>(points.size());
  SUPERFACETS_ASSERT(positions.size() == points.size() && areas.size() == points.size());
  SUPERFACETS_ASSERT(normals.size() == points.size());
  TurnedSets sets = join_neighbors(neighbors, points, normals);
  struct Sums {
    double area = 0.0;
    Point moment{0.0, 0.0, 0.0};  // sum of area times position
    double volume = 0.0;          // three times the enclosed volume
  };
  std::vector<Sums> sums(points.size());  // sums of each set, stored at the index of its root
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
