#include "paths/second_paths.hpp"

#include <utility>
#include <vector>

#include "base/assert.hpp"

namespace superfacets {
namespace {

struct Entering {
  Place place;
  Path path;
};

// For each place behind a border, the best path that crosses the border to it. Arcs are scanned
// from their sources, because they may have no reverse arcs.
Buffer<Entering> paths_across_borders(const OrderedGraph& graph, std::span<const Path> nearest,
                                      ThreadTeam& team) {
  const auto add_crossing = [&](Place place, std::vector<Entering>& found) {
    const Path path = nearest[place];
    if (path.label == kNoLabel) return;
    for (const Arc& arc : graph.arcs_of(place)) {
      if (nearest[arc.to].label == path.label) continue;
      found.push_back({arc.to, {longer_by(path.length, arc), path.label}});
    }
  };
  return gather<Entering>(graph.n_cells(), add_crossing, team);
}

// Dijkstra's algorithm within a region, from all of its places with a path.
void expand_inwards(const OrderedGraph& graph, std::span<const Path> nearest,
                    std::span<const Place> region, RadixHeap& heap, std::span<Path> seconds) {
  heap.restart();
  for (const Place place : region) {
    if (seconds[place].label != kNoLabel) heap.push(seconds[place].length, place);
  }
  while (!heap.empty()) {
    const auto [length, place] = heap.pop();
    const Path path = seconds[place];
    if (length != path.length) continue;
    for (const Arc& arc : graph.arcs_of(place)) {
      if (nearest[arc.to].label != nearest[place].label) continue;
      const Path longer{longer_by(path.length, arc), path.label};
      if (!longer.is_better_than(seconds[arc.to])) continue;
      seconds[arc.to] = longer;
      heap.push(longer.length, arc.to);
    }
  }
}

}  // namespace

Regions::Regions(std::span<const Path> paths, Label n_regions)
    : places(group<Place>(n_regions, [&](const auto& add) {
        for (Place place = 0; std::cmp_less(place, paths.size()); ++place) {
          if (paths[place].label != kNoLabel) add(paths[place].label, place);
        }
      })) {}

Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(nearest.size(), graph.n_cells()));
  Buffer<Path> seconds(graph.n_cells());
  team.fill(seconds.span(), Path{});
  for (const auto& [place, path] : paths_across_borders(graph, nearest, team)) {
    if (path.is_better_than(seconds[place])) seconds[place] = path;
  }
  std::vector<RadixHeap> heaps(team.size());
  team.for_each(regions.places.n_lists(), [&](std::int64_t label, int thread) {
    expand_inwards(graph, nearest, regions.of(static_cast<Label>(label)), heaps[thread],
                   seconds.span());
  });
  return seconds;
}

}  // namespace superfacets
