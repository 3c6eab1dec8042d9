#include "paths/halting.hpp"

#include "base/lists.hpp"

namespace superfacets {
namespace {

// Maximum number of threads. Each thread needs 8 bytes per cell, and more threads would not be
// faster.
constexpr std::int64_t kMaxWorkers = 4;

}  // namespace

HaltedPaths::HaltedPaths(const OrderedGraph& graph, double reach, ThreadTeam& team)
    : graph_(graph),
      squared_reach_(reach * reach),
      team_(team),
      doubt_of_(graph.n_cells()),
      n_workers_(std::min<std::int64_t>(team.size(), kMaxWorkers)),
      workers_(n_workers_) {
  team.fill(doubt_of_.span(), kNoDoubt);
}

void HaltedPaths::correct(const Expansion& exact, std::span<const Place> centers) {
  for (const Doubt& doubt : doubts_) doubt_of_[doubt.place] = kNoDoubt;
  doubts_.clear();
  find_doubts(exact, centers);
  expand_all(centers_in_doubt(centers), centers);
}

void HaltedPaths::add_doubt(Place place, const Path& path) {
  SUPERFACETS_ASSERT(doubt_of_[place] == kNoDoubt);
  doubt_of_[place] = static_cast<std::int32_t>(doubts_.size());
  doubts_.push_back({place, path});
}

// Finds the uncertain cells: unreached cells, and cells to which a shortest path passes through a
// cell outside the radius `reach` of its center. If the graph is not symmetric, all cells are
// uncertain. If a cell has another shortest path within the radius, it is checked unnecessarily.
void HaltedPaths::find_doubts(const Expansion& exact, std::span<const Place> centers) {
  const auto add_halted = [&](Place place, std::vector<Place>& found) {
    const Label label = exact.path(place).label;
    SUPERFACETS_ASSERT(label < std::ssize(centers));
    const bool is_known = label != kNoLabel && graph_.is_symmetric;
    if (!is_known || !is_within_reach(centers[label], place)) found.push_back(place);
  };
  const Buffer<Place> found = gather<Place>(graph_.n_cells(), add_halted, team_);
  std::vector<Place> halted(found.begin(), found.end());
  for (const Place place : halted) {
    if (exact.path(place).label == kNoLabel || !graph_.is_symmetric) add_doubt(place, {});
  }
  // The list grows while it is traversed.
  for (std::size_t i = 0; i < halted.size(); ++i) {
    const Path path = exact.path(halted[i]);
    if (path.label == kNoLabel) continue;
    for (const Arc arc : graph_.arcs_of(halted[i])) {
      const Path behind = exact.path(arc.to);
      if (behind.label != path.label || behind.length != longer_by(path.length, arc)) continue;
      if (doubt_of_[arc.to] != kNoDoubt) continue;
      add_doubt(arc.to, {});
      halted.push_back(arc.to);
    }
  }
}

// The centers whose expansion may reach an uncertain cell: every center with an uncertain cell, or
// a neighbor of such a cell, within the radius `reach`. If the graph is not symmetric, the result
// contains all centers.
std::vector<Label> HaltedPaths::centers_in_doubt(std::span<const Place> centers) const {
  std::vector<Label> labels;
  if (!graph_.is_symmetric) {
    labels.resize(centers.size());
    std::iota(labels.begin(), labels.end(), Label{0});
    return labels;
  }
  // [level][node] whether the node contains an uncertain cell or a neighbor of an uncertain cell
  std::vector<std::vector<char>> has_source;
  has_source.reserve(graph_.tree.n_levels());
  for (std::size_t level = 0; level < graph_.tree.n_levels(); ++level) {
    has_source.emplace_back(graph_.tree.level(level).size(), 0);
  }
  const auto mark = [&](Place place) {
    std::size_t node = static_cast<std::size_t>(place) / BoxTree::kLeaf;
    for (auto& of_level : has_source) {
      if (std::exchange(of_level[node], 1) != 0) return;
      node /= BoxTree::kFanOut;
    }
  };
  for (const Doubt& doubt : doubts_) {
    mark(doubt.place);
    for (const Arc arc : graph_.arcs_of(doubt.place)) mark(arc.to);
  }
  for (std::size_t label = 0; label < centers.size(); ++label) {
    const Point& center = graph_.positions[centers[label]];
    bool is_in_reach = false;
    const auto may_hold = [&](std::size_t level, std::size_t index) {
      return !is_in_reach && has_source[level][index] != 0 &&
             graph_.tree.level(level)[index].squared_distance(center) <= squared_reach_;
    };
    graph_.tree.visit_leaves(may_hold, [&](std::size_t) { is_in_reach = true; });
    if (is_in_reach) labels.push_back(static_cast<Label>(label));
  }
  return labels;
}

void HaltedPaths::expand(Place center, SourcePaths& worker) const {
  worker.expand(center, [&](Place place, PathLength) { return is_within_reach(center, place); });
}

void HaltedPaths::expand_all(std::span<const Label> labels, std::span<const Place> centers) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  team_.for_each(n_workers_, [&](std::int64_t task, int) {
    SourcePaths& worker = workers_.get(task, graph_);
    for (std::size_t i = next++; i < labels.size(); i = next++) {
      expand(centers[labels[i]], worker);
      std::vector<Doubt> found;
      worker.take([&](Place place, PathLength length) {
        if (doubt_of_[place] != kNoDoubt) found.push_back({place, {length, labels[i]}});
      });
      const std::scoped_lock lock(mutex);
      for (const auto& [place, path] : found) {
        Path& best = doubts_[doubt_of_[place]].path;
        if (path.is_better_than(best)) best = path;
      }
    }
  });
}

void HaltedPaths::adopt_orphans(const Expansion& exact, std::vector<Place>& centers) {
  std::vector<Place> orphans;
  for (const Doubt& doubt : doubts_) {
    if (doubt.path.label == kNoLabel) orphans.push_back(doubt.place);
  }
  std::ranges::sort(orphans,
                    [&](Place a, Place b) { return graph_.cell_at(a) < graph_.cell_at(b); });
  for (const Place orphan : orphans) {
    if (doubts_[doubt_of_[orphan]].path.label != kNoLabel) continue;
    const auto label = static_cast<Label>(centers.size());
    centers.push_back(orphan);
    SourcePaths& worker = workers_.get(0, graph_);
    expand(orphan, worker);
    worker.take([&](Place place, PathLength length) {
      const Path found{length, label};
      if (!found.is_better_than(path(exact, place))) return;
      if (doubt_of_[place] == kNoDoubt) add_doubt(place, found);
      doubts_[doubt_of_[place]].path = found;
    });
  }
}

}  // namespace superfacets
