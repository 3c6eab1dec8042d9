#include "paths/halting.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// Each thread needs 8 bytes per cell; more threads would cost memory and save no time.
constexpr std::int64_t kMaxWorkers = 4;

}  // namespace

HaltedPaths::HaltedPaths(const OrderedGraph& graph, double reach, ThreadTeam& team)
    : graph_(graph),
      squared_reach_(reach * reach),
      team_(team),
      doubt_of_(graph.n_cells()),
      workers_(std::min<std::int64_t>(team.size(), kMaxWorkers)) {
  team.for_each_block(graph.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    std::fill(doubt_of_.begin() + begin, doubt_of_.begin() + end, kNoDoubt);
  });
}

void HaltedPaths::correct(const Expansion& exact, std::span<const Place> centers) {
  for (const Doubt& doubt : doubts_) doubt_of_[doubt.place] = kNoDoubt;
  doubts_.clear();
  find_doubts(exact, centers);
  expand_all(centers_in_doubt(centers), centers);
}

bool HaltedPaths::is_within_reach(Place center, Place place) const {
  return squared_norm(graph_.positions[place] - graph_.positions[center]) <= squared_reach_;
}

void HaltedPaths::add_doubt(Place place, const Path& path) {
  SUPERFACETS_ASSERT(doubt_of_[place] == kNoDoubt);
  doubt_of_[place] = static_cast<std::int32_t>(doubts_.size());
  doubts_.push_back({place, path});
}

// A place is uncertain if some shortest path to it leaves the reach of its center. (If an equally
// short path stays within reach, the place is checked unnecessarily.)
void HaltedPaths::find_doubts(const Expansion& exact, std::span<const Place> centers) {
  std::mutex mutex;
  std::vector<Place> halted;
  auto find_halted = [&](std::int64_t begin, std::int64_t end) {
    std::vector<Place> found;
    for (auto place = static_cast<Place>(begin); place < end; ++place) {
      const Label label = exact.path(place).label;
      SUPERFACETS_ASSERT(label < std::ssize(centers));
      const bool is_known = label != kNoLabel && graph_.is_symmetric;
      if (!is_known || !is_within_reach(centers[label], place)) found.push_back(place);
    }
    const std::scoped_lock lock(mutex);
    halted.insert(halted.end(), found.begin(), found.end());
  };
  team_.for_each_block(graph_.n_cells(), find_halted);
  for (const Place place : halted) {
    if (exact.path(place).label == kNoLabel || !graph_.is_symmetric) add_doubt(place, {});
  }
  // The list grows while it is traversed.
  for (std::size_t i = 0; i < halted.size(); ++i) {
    const Path path = exact.path(halted[i]);
    if (path.label == kNoLabel) continue;
    for (const Arc& arc : graph_.arcs_of(halted[i])) {
      const Path behind = exact.path(arc.to);
      const PathLength longer = path.length + static_cast<PathLength>(arc.length);
      if (behind.label != path.label || behind.length != longer) continue;
      if (doubt_of_[arc.to] != kNoDoubt) continue;
      add_doubt(arc.to, {});
      halted.push_back(arc.to);
    }
  }
}

// The centers whose expansion may reach an uncertain place: centers within reach of a place with an
// arc to an uncertain place. On a graph that is not symmetric, all centers.
std::vector<Label> HaltedPaths::centers_in_doubt(std::span<const Place> centers) const {
  std::vector<std::vector<char>> is_source;  // for each node of the tree: it holds such a place
  is_source.reserve(graph_.tree.n_levels());
  for (std::size_t level = 0; level < graph_.tree.n_levels(); ++level) {
    is_source.emplace_back(graph_.tree.level(level).size(), 0);
  }
  mark_sources(is_source);
  std::vector<Label> labels;
  for (std::size_t label = 0; label < centers.size(); ++label) {
    if (!graph_.is_symmetric || reaches(is_source, centers[label], graph_.tree.n_levels() - 1, 0)) {
      labels.push_back(static_cast<Label>(label));
    }
  }
  return labels;
}

void HaltedPaths::mark_sources(std::vector<std::vector<char>>& is_source) const {
  auto mark = [&](Place place) { is_source.front()[place / BoxTree::kLeaf] = 1; };
  for (const Doubt& doubt : doubts_) {
    mark(doubt.place);
    for (const Arc& arc : graph_.arcs_of(doubt.place)) mark(arc.to);
  }
  for (std::size_t level = 1; level < is_source.size(); ++level) {
    for (std::size_t child = 0; child < is_source[level - 1].size(); ++child) {
      is_source[level][child / BoxTree::kFanOut] |= is_source[level - 1][child];
    }
  }
}

bool HaltedPaths::reaches(const std::vector<std::vector<char>>& is_source, Place center,
                          std::size_t level, std::size_t index) const {
  if (is_source[level][index] == 0) return false;
  const Box& box = graph_.tree.level(level)[index];
  if (box.squared_distance(graph_.positions[center]) > squared_reach_) return false;
  if (level == 0) return true;
  const auto [begin, end] = graph_.tree.children(level, index);
  for (auto child = begin; child < end; ++child) {
    if (reaches(is_source, center, level - 1, child)) return true;
  }
  return false;
}

SourcePaths& HaltedPaths::worker(std::int64_t number) {
  if (!workers_[number]) workers_[number] = std::make_unique<SourcePaths>(graph_);
  return *workers_[number];
}

void HaltedPaths::expand(Place center, SourcePaths& worker) const {
  worker.expand(center, [&](Place place, PathLength) { return is_within_reach(center, place); });
}

void HaltedPaths::expand_all(std::span<const Label> labels, std::span<const Place> centers) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  team_.for_each(static_cast<std::int64_t>(workers_.size()), [&](std::int64_t task, int) {
    SourcePaths& worker = this->worker(task);
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
  std::ranges::sort(orphans, [&](Place a, Place b) { return graph_.cells[a] < graph_.cells[b]; });
  for (const Place orphan : orphans) {
    if (doubts_[doubt_of_[orphan]].path.label != kNoLabel) continue;
    const auto label = static_cast<Label>(centers.size());
    centers.push_back(orphan);
    SourcePaths& worker = this->worker(0);
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
