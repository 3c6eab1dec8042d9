#include "paths/longest_paths.hpp"

namespace superfacets {
namespace {

// Number of cells per block. Searching a block takes less than a microsecond, much less than the
// expansion from a new center.
constexpr std::int64_t kBlock = 1 << 8;

}  // namespace

LongestPaths::LongestPaths(const OrderedGraph& graph, ThreadTeam& team)
    : graph_(graph), paths_(graph, team) {
  for (std::int64_t block = 0; block * kBlock < graph.n_cells(); ++block) {
    bounds_.push_back({kUnreached, 0, block});
  }
}

void LongestPaths::place(Place center) {
  place_all({&center, 1});
}

void LongestPaths::place_all(std::span<const Place> centers) {
  for (const Place center : centers) paths_.start(center, n_placed_++);
  paths_.run();
}

bool LongestPaths::reach_all() const {
  for (Place place = 0; place < graph_.n_cells(); ++place) {
    if (!reaches(place)) return false;
  }
  return true;
}

// Paths never become longer, so an earlier maximum of a block remains an upper bound. Bounds are
// compared by (length, lowest cell). The block with the highest bound is searched again. If the
// search confirms the bound, it is the maximum of all blocks; otherwise the next block is searched.
// If all paths are equally long, only one block is searched.
Place LongestPaths::farthest() {
  while (true) {
    std::pop_heap(bounds_.begin(), bounds_.end());
    Bound& bound = bounds_.back();
    const auto [length, place] = farthest_in(bound.block);
    const Cell cell = graph_.cell_at(place);
    const bool is_exact = bound.longest == length && bound.cell == cell;
    bound = {length, cell, bound.block};
    std::push_heap(bounds_.begin(), bounds_.end());
    if (!is_exact) continue;
    SUPERFACETS_ASSERT(length > 0);  // only centers have paths of length 0
    return place;
  }
}

LongestPaths::Farthest LongestPaths::farthest_in(std::int64_t block) const {
  const auto begin = static_cast<Place>(block * kBlock);
  const auto end =
      static_cast<Place>(std::min<std::int64_t>((block + 1) * kBlock, graph_.n_cells()));
  Farthest farthest{0, begin};
  for (Place place = begin; place < end; ++place) {
    const PathLength length = paths_.path(place).length;
    if (length == kUnreached || length < farthest.length) continue;
    if (length == farthest.length && graph_.cell_at(place) > graph_.cell_at(farthest.place))
      continue;
    farthest = {length, place};
  }
  return farthest;
}

}  // namespace superfacets
