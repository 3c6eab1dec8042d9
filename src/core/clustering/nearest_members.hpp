// For many regions, finds the cell of the region that is nearest to a given point.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// For each region, finds the cell of the region that is nearest to its target point; the lowest
// cell if several are equally near. `regions` contains labels in ascending order. On entry,
// `places` contains any cell of each region; the search is fast if this cell is near the target. On
// return, `places` contains the nearest cells. label_of(place) is called on several threads. A
// search visits at most kMinVisits + kVisitFactor * (number of leaves / number of regions) nodes
// of the box tree. A search stops early if, for example, the target is far from the region or many
// cells are equally near. If searches of some regions have stopped early, a single pass over all
// cells then finds the results for these regions. If regions have few cells on average, only the
// pass is used, because it is faster. Time O(N + R log N).
template <typename LabelOf>
void find_nearest_members(const OrderedGraph& graph, std::span<const Label> regions,
                          std::span<const Point> targets, const LabelOf& label_of,
                          std::span<Place> places, ThreadTeam& team) {
  constexpr std::int64_t kMinVisits = 32;
  // see n_visits, the maximum number of nodes visited by a search
  constexpr std::int64_t kVisitFactor = 16;
  // Below this mean number of cells per region, only the pass over all cells is used.
  constexpr std::int64_t kFewPlaces = 64;
  const std::int64_t n_regions = std::ssize(regions);
  if (n_regions == 0) return;
  const std::int64_t n_leaves = std::ssize(graph.tree.level(0));
  const std::int64_t n_visits = kMinVisits + kVisitFactor * n_leaves / n_regions;
  std::vector<std::uint8_t> is_found(n_regions);
  const bool are_searched = graph.n_cells() >= kFewPlaces * n_regions;
  team.for_each(are_searched ? n_regions : 0, [&](std::int64_t i, int) {
    const auto is_member = [&](Place place) { return label_of(place) == regions[i]; };
    NearestPlace nearest(graph, targets[i], places[i]);
    is_found[i] = static_cast<std::uint8_t>(nearest.search(is_member, n_visits));
    places[i] = nearest.place();
  });

  constexpr std::int64_t kNotGivenUp = -1;
  // index of each label in given_up, or kNotGivenUp
  std::vector<std::int64_t> given_up_of(regions.back() + 1, kNotGivenUp);
  std::vector<NearestPlace> given_up;
  for (std::int64_t i = 0; i < n_regions; ++i) {
    if (is_found[i] != 0) continue;
    given_up_of[regions[i]] = std::ssize(given_up);
    given_up.emplace_back(graph, targets[i], places[i]);
  }
  if (given_up.empty()) return;
  // Each thread passes over all cells, and updates only its own part of the regions.
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
