// Finds the cell of a region nearest to a point, for many regions.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// For each region, finds the place nearest to the target of the region among the places with its
// label. Ties go to the lowest cell. `regions` is ascending. On entry, `places` holds any place of
// each region; a place near the target makes the search fast. On return, `places` holds the nearest
// places. label_of(place) may be called on any thread. Time O(N + R log N). A search in the box
// tree stops after kShares times the region's share of all leaves, for example if the target is far
// away or many cells are equally near. One pass over all places then finds the results for the
// remaining regions. A region of few places is not
// searched for, because the pass takes less time.
template <typename LabelOf>
void find_nearest_members(const OrderedGraph& graph, std::span<const Label> regions,
                          std::span<const Point> targets, const LabelOf& label_of,
                          std::span<Place> places, ThreadTeam& team) {
  constexpr std::int64_t kLeastVisits = 32;
  // limit of a search, in multiples of (number of leaves) / (number of regions)
  constexpr std::int64_t kShares = 16;
  constexpr std::int64_t kFewPlaces = 64;  // per region
  const std::int64_t n_regions = std::ssize(regions);
  if (n_regions == 0) return;
  const std::int64_t n_leaves = std::ssize(graph.tree.level(0));
  const std::int64_t n_visits = kLeastVisits + kShares * n_leaves / n_regions;
  std::vector<std::uint8_t> is_found(n_regions);
  const bool are_searched = graph.n_cells() >= kFewPlaces * n_regions;
  team.for_each(are_searched ? n_regions : 0, [&](std::int64_t i, int) {
    const auto is_member = [&](Place place) { return label_of(place) == regions[i]; };
    NearestPlace nearest(graph, targets[i], places[i]);
    is_found[i] = static_cast<std::uint8_t>(nearest.search(is_member, n_visits));
    places[i] = nearest.place();
  });

  constexpr std::int64_t kNotGivenUp = -1;
  // (by label) index among the regions whose search gave up
  std::vector<std::int64_t> given_up_of(regions.back() + 1, kNotGivenUp);
  std::vector<NearestPlace> given_up;
  for (std::int64_t i = 0; i < n_regions; ++i) {
    if (is_found[i] != 0) continue;
    given_up_of[regions[i]] = std::ssize(given_up);
    given_up.emplace_back(graph, targets[i], places[i]);
  }
  if (given_up.empty()) return;
  // Each thread has some of the regions.
  const std::int64_t n_parts = std::min<std::int64_t>(team.size(), std::ssize(given_up));
  team.for_each(n_parts, [&](std::int64_t part, int) {
    const std::int64_t begin = part * std::ssize(given_up) / n_parts;
    const std::int64_t end = (part + 1) * std::ssize(given_up) / n_parts;
    for (Place place = 0; place < graph.n_cells(); ++place) {
      const Label label = label_of(place);
      if (label == kNoLabel || label > regions.back()) continue;
      const std::int64_t i = given_up_of[label];
      if (i >= begin && i < end) given_up[i].offer(place);
    }
  });
  for (std::int64_t i = 0; i < n_regions; ++i) {
    if (is_found[i] == 0) places[i] = given_up[given_up_of[regions[i]]].place();
  }
}

}  // namespace superfacets
