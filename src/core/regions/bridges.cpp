#include "regions/bridges.hpp"

namespace superfacets {
namespace {

class BridgeSearch {
 public:
  BridgeSearch(const PlacedCells& cells, std::span<const Cell> ranks, Cell n_components)
      : cells_(cells), bridges_(n_components) {
    for (Place place = 0; place < cells.n_cells(); ++place) {
      ranks_.push_back(ranks[cells.cell_at(place)]);
    }
    lowest_ranks_ = cells.tree.summarize<Cell>(
        ranks_, n_components, [](Cell& lowest, Cell rank) { lowest = std::min(lowest, rank); });
  }

  std::vector<Bridge> search_all() {
    // First compares cells that are adjacent along the space-filling curve. These cells are usually
    // near in space, so the tree search starts with a short bridge.
    Place last_lower = kNoPlace;
    for (Place place = 1; place < cells_.n_cells(); ++place) {
      if (ranks_[place - 1] < ranks_[place]) last_lower = place - 1;
      if (last_lower != kNoPlace && ranks_[last_lower] < ranks_[place]) compare(place, last_lower);
      if (ranks_[place] < ranks_[place - 1]) compare(place - 1, place);
    }
    for (Place place = 0; place < cells_.n_cells(); ++place) search_from(place);
    bridges_.erase(bridges_.begin());
    return std::move(bridges_);
  }

 private:
  void search_from(Place place) {
    const Cell rank = ranks_[place];
    const Point& target = cells_.positions[place];
    const auto may_hold = [&](std::size_t level, std::size_t index) {
      return lowest_ranks_[level][index] < rank && cells_.tree.level(level)[index].squared_distance(
                                                       target) <= bridges_[rank].squared_length;
    };
    cells_.tree.visit_leaves(may_hold, [&](std::size_t leaf) {
      const auto [begin, end] = cells_.tree.places(leaf);
      for (auto other = begin; other < end; ++other) {
        if (ranks_[other] < rank) compare(place, static_cast<Place>(other));
      }
    });
  }

  void compare(Place from, Place to) {
    const double squared = squared_norm(cells_.positions[to] - cells_.positions[from]);
    Bridge& best = bridges_[ranks_[from]];
    best = std::min(best, {squared, cells_.cell_at(from), cells_.cell_at(to)});
  }

  const PlacedCells& cells_;
  std::vector<Cell> ranks_;                      // component rank of each cell, in sorted order
  std::vector<std::vector<Cell>> lowest_ranks_;  // [level][node] lowest rank in each tree node
  std::vector<Bridge> bridges_;                  // best bridge found for each rank
};

}  // namespace

std::vector<Bridge> find_bridges(const PlacedCells& cells, std::span<const Cell> ranks,
                                 Cell n_components) {
  SUPERFACETS_ASSERT(std::cmp_equal(ranks.size(), cells.n_cells()) && n_components > 0);
  SUPERFACETS_ASSERT(all_below(ranks, n_components));
  return BridgeSearch(cells, ranks, n_components).search_all();
}

}  // namespace superfacets
