#include "paths/longest_paths.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// A block takes less than a microsecond, little compared with the expansion from a new center.
constexpr std::int64_t kBlock = 1 << 8;

}  // namespace

LongestPaths::LongestPaths(const OrderedGraph& graph, ThreadTeam& team)
    : graph_(graph), paths_(graph, team) {
  for (std::int64_t block = 0; block * kBlock < graph.n_cells(); ++block) {
    bounds_.push_back({kUnreached, block});
  }
}

void LongestPaths::place(Place center) {
  paths_.start(center, n_placed_++);
  paths_.run();
}

bool LongestPaths::reach_all() const {
  for (Place place = 0; place < graph_.n_cells(); ++place) {
    if (!reaches(place)) return false;
  }
  return true;
}

// Paths only become shorter, so an earlier maximum of a block remains an upper bound. Only blocks
// whose bound is at least the longest path found so far have to be searched again.
Place LongestPaths::farthest() {
  Farthest farthest{0, 0};
  std::vector<Bound> looked_at;
  while (!bounds_.empty() && bounds_.front().longest >= farthest.length) {
    std::pop_heap(bounds_.begin(), bounds_.end());
    const std::int64_t block = bounds_.back().block;
    bounds_.pop_back();
    const Farthest other = farthest_in(block);
    looked_at.push_back({other.length, block});
    const bool is_lower = graph_.cells[other.place] < graph_.cells[farthest.place];
    if (other.length > farthest.length || (other.length == farthest.length && is_lower)) {
      farthest = other;
    }
  }
  for (const Bound& bound : looked_at) {
    bounds_.push_back(bound);
    std::push_heap(bounds_.begin(), bounds_.end());
  }
  SUPERFACETS_ASSERT(farthest.length > 0);  // arcs are 1 or longer: it is no center
  return farthest.place;
}

LongestPaths::Farthest LongestPaths::farthest_in(std::int64_t block) const {
  const auto begin = static_cast<Place>(block * kBlock);
  const auto end =
      static_cast<Place>(std::min<std::int64_t>((block + 1) * kBlock, graph_.n_cells()));
  Farthest farthest{0, begin};
  for (Place place = begin; place < end; ++place) {
    const PathLength length = paths_.path(place).length;
    if (length == kUnreached || length < farthest.length) continue;
    if (length == farthest.length && graph_.cells[place] > graph_.cells[farthest.place]) continue;
    farthest = {length, place};
  }
  return farthest;
}

}  // namespace superfacets
