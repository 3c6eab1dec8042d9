#include "paths/second_paths.hpp"

#include <mutex>

#include "base/assert.hpp"

namespace superfacets {
namespace {

PathLength longer_by(PathLength length, const Arc& arc) {
  return length + static_cast<PathLength>(arc.length);
}

struct Entering {
  Place place;
  Path path;
};

// The paths that cross a border, by the place behind it. They are found at their sources, because
// arcs may have no reverse arcs.
std::vector<Entering> paths_across_borders(const OrderedGraph& graph, std::span<const Path> nearest,
                                           ThreadTeam& team) {
  std::vector<Entering> all;
  std::mutex mutex;
  team.for_each_block(graph.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    std::vector<Entering> found;
    for (auto place = static_cast<Place>(begin); place < end; ++place) {
      const Path path = nearest[place];
      if (path.label == kNoLabel) continue;
      for (const Arc& arc : graph.arcs_of(place)) {
        if (nearest[arc.to].label == path.label) continue;
        found.push_back({arc.to, {longer_by(path.length, arc), path.label}});
      }
    }
    const std::scoped_lock lock(mutex);
    all.insert(all.end(), found.begin(), found.end());
  });
  return all;
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
    : starts(static_cast<std::size_t>(n_regions) + 1, 0) {
  for (const Path& path : paths) {
    if (path.label != kNoLabel) ++starts[path.label + 1];
  }
  for (Label label = 0; label < n_regions; ++label) starts[label + 1] += starts[label];
  places.resize(starts.back());
  std::vector<std::int64_t> cursors(starts.begin(), starts.end() - 1);
  for (std::size_t place = 0; place < paths.size(); ++place) {
    const Label label = paths[place].label;
    if (label != kNoLabel) places[cursors[label]++] = static_cast<Place>(place);
  }
}

Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Regions& regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(nearest.size(), graph.n_cells()));
  Buffer<Path> seconds(graph.n_cells());
  team.fill(seconds.span(), Path{});
  for (const auto& [place, path] : paths_across_borders(graph, nearest, team)) {
    if (path.is_better_than(seconds[place])) seconds[place] = path;
  }
  std::vector<RadixHeap> heaps(team.size());
  const auto n_regions = std::ssize(regions.starts) - 1;
  team.for_each(n_regions, [&](std::int64_t label, int thread) {
    expand_inwards(graph, nearest, regions.of(static_cast<Label>(label)), heaps[thread],
                   seconds.span());
  });
  return seconds;
}

}  // namespace superfacets
