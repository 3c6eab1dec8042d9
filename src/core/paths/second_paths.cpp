#include "paths/second_paths.hpp"

namespace superfacets {
namespace {

// Logical AND and OR that evaluate both operands, without a branch.
bool both(bool one, bool other) {
  return (static_cast<unsigned>(one) & static_cast<unsigned>(other)) != 0;
}
bool either(bool one, bool other) {
  return (static_cast<unsigned>(one) | static_cast<unsigned>(other)) != 0;
}

// For each cell, finds the best path whose last arc comes from another region. The loop has no
// branches, because it is unpredictable which arcs cross borders.
void enter_regions(const OrderedGraph& graph, std::span<const Path> nearest, ThreadTeam& team,
                   std::span<Path> seconds) {
  SUPERFACETS_ASSERT(graph.is_symmetric);
  team.for_each_slow(graph.n_cells(), [&](Place place) {
    const Label label = nearest[place].label;
    Path best;
    for (const Arc arc : graph.arcs_of(place)) {
      const Path& there = nearest[arc.to];
      const bool crosses = both(there.label != label, there.label != kNoLabel);
      const PathLength length = longer_by(crosses ? there.length : 0, arc);
      const bool is_better =
          either(length < best.length, both(length == best.length, there.label < best.label));
      best = both(crosses, is_better) ? Path{length, there.label} : best;
    }
    seconds[place] = best;
  });
}

// Like enter_regions, for graphs with one-way arcs. Each arc is visited at its source cell.
void enter_along_arcs(const OrderedGraph& graph, std::span<const Path> nearest, ThreadTeam& team,
                      std::span<Path> seconds) {
  team.fill(seconds, Path{});
  for (Place place = 0; place < graph.n_cells(); ++place) {
    const Path path = nearest[place];
    if (path.label == kNoLabel) continue;
    for (const Arc arc : graph.arcs_of(place)) {
      if (nearest[arc.to].label == path.label) continue;
      const Path longer{longer_by(path.length, arc), path.label};
      if (longer.is_better_than(seconds[arc.to])) seconds[arc.to] = longer;
    }
  }
}

// Extends paths that enter a region to all cells of the region. A label-correcting search extends
// all improved paths by one arc per round. Regions are a few arcs wide, so a few rounds usually
// suffice. Otherwise, the search switches to Dijkstra's algorithm.
class Inwards {
 public:
  Inwards(const OrderedGraph& graph, std::span<const Path> nearest, std::span<Path> seconds)
      : graph_(graph), nearest_(nearest), seconds_(seconds), is_waiting_(graph.n_cells(), 0) {}

  void expand(std::span<const Place> region) {
    waiting_.clear();
    for (const Place place : region) {
      if (seconds_[place].label != kNoLabel) wait(place, waiting_);
    }
    std::size_t n_expanded = 0;
    while (!waiting_.empty()) {
      n_expanded += waiting_.size();
      for (const Place place : waiting_) is_waiting_[place] = 0;
      if (n_expanded > kMaxExpanded * region.size()) return expand_in_order();
      next_.clear();
      for (const Place place : waiting_) relax(place, [&](Place to) { wait(to, next_); });
      std::swap(waiting_, next_);
    }
  }

 private:
  // Maximum number of expansions per cell of the region. Above this number, the search switches to
  // Dijkstra's algorithm.
  static constexpr std::size_t kMaxExpanded = 4;

  void wait(Place place, std::vector<Place>& list) {
    if (std::exchange(is_waiting_[place], 1) == 0) list.push_back(place);
  }

  void expand_in_order() {
    heap_.restart();
    for (const Place place : waiting_) heap_.push(seconds_[place].length, place);
    while (!heap_.empty()) {
      const auto [length, place] = heap_.pop();
      if (length != seconds_[place].length) continue;
      relax(place, [&](Place to) { heap_.push(seconds_[to].length, to); });
    }
  }

  // Calls push(to) for each neighbor whose path is improved by the path via this cell.
  template <typename Push>
  void relax(Place place, const Push& push) {
    const Path path = seconds_[place];
    const Label label = nearest_[place].label;
    for (const Arc arc : graph_.arcs_of(place)) {
      // Skips other regions, whose paths may be written by other threads.
      if (nearest_[arc.to].label != label) continue;
      const Path longer{longer_by(path.length, arc), path.label};
      if (!longer.is_better_than(seconds_[arc.to])) continue;
      seconds_[arc.to] = longer;
      push(arc.to);
    }
  }

  const OrderedGraph& graph_;
  const std::span<const Path> nearest_;
  const std::span<Path> seconds_;
  std::vector<Place> waiting_, next_;
  std::vector<std::uint8_t> is_waiting_;  // (N,) 1 if a cell is in the list of the next round
  RadixHeap heap_;
};

}  // namespace

Lists<Place> regions_of(std::span<const Path> paths, Label n_regions) {
  return group<Place>(n_regions, [&](const auto& add) {
    for (Place place = 0; std::cmp_less(place, paths.size()); ++place) {
      if (paths[place].label != kNoLabel) add(paths[place].label, place);
    }
  });
}

Buffer<Path> second_paths(const OrderedGraph& graph, std::span<const Path> nearest,
                          const Lists<Place>& regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(nearest.size(), graph.n_cells()));
  Buffer<Path> seconds(graph.n_cells());
  if (graph.is_symmetric) {
    enter_regions(graph, nearest, team, seconds.span());
  } else {
    enter_along_arcs(graph, nearest, team, seconds.span());
  }
  PerThread<Inwards> searches(team.size());
  team.for_each(regions.n_lists(), [&](std::int64_t label, int thread) {
    searches.get(thread, graph, nearest, seconds.span()).expand(regions[label]);
  });
  return seconds;
}

}  // namespace superfacets
