// A bounding volume hierarchy: a tree of boxes over cells that are sorted along a space-filling
// curve.
#pragma once

#include <array>
#include <cstddef>

#include "base/box.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Each leaf contains a range of consecutive cells. Ranges have a fixed size, or are given by the
// caller. A node has up to kFanOut children in the level below.
class BoxTree {
 public:
  // default number of cells per leaf; their positions fill twelve cache lines
  static constexpr std::size_t kLeaf = 32;
  // number of children per node; a cube on a Morton curve has eight octants
  static constexpr std::size_t kFanOut = 8;

  BoxTree() = default;  // creates an empty tree
  // Builds a tree over points that are sorted along the curve.
  BoxTree(std::span<const Point> positions, ThreadTeam& team)
      : BoxTree(
            positions.size(), kLeaf,
            [&](std::size_t place) { return Box{positions[place], positions[place]}; }, team) {}
  // Builds a tree over cells with an extent. box_of(place) must return the box of a cell. box_of is
  // called once for each cell, on any thread.
  template <typename BoxOf>
  BoxTree(std::size_t n_cells, std::size_t leaf_size, const BoxOf& box_of, ThreadTeam& team)
      : n_cells_(n_cells), leaf_size_(leaf_size) {
    add_levels((n_cells + leaf_size - 1) / leaf_size, box_of, team);
  }
  // Builds a tree over points with given leaves: leaf i contains the points starts[i] ..
  // starts[i+1]-1.
  BoxTree(std::span<const Point> positions, std::vector<Place> starts, ThreadTeam& team)
      : n_cells_(positions.size()), starts_(std::move(starts)) {
    const auto box_of = [&](std::size_t place) { return Box{positions[place], positions[place]}; };
    add_levels(starts_.size() - 1, box_of, team);
  }

  bool empty() const { return n_cells_ == 0; }
  // Number of levels. Level 0 consists of the leaves, and the last level consists of the root.
  std::size_t n_levels() const { return levels_.size(); }
  std::span<const Box> level(std::size_t level) const { return levels_[level]; }
  // The children of an inner node, as a pair (first, one past the last).
  std::pair<std::size_t, std::size_t> children(std::size_t level, std::size_t index) const {
    SUPERFACETS_ASSERT(level > 0 && level < n_levels() && index < levels_[level].size());
    return {index * kFanOut, std::min((index + 1) * kFanOut, levels_[level - 1].size())};
  }
  // The cells of a leaf, as a pair (first, one past the last).
  std::pair<std::size_t, std::size_t> places(std::size_t leaf) const {
    if (!starts_.empty()) return {starts_[leaf], starts_[leaf + 1]};
    SUPERFACETS_ASSERT(leaf * leaf_size_ < n_cells_);
    return {leaf * leaf_size_, std::min((leaf + 1) * leaf_size_, n_cells_)};
  }

  // Computes a value for each node. The result is indexed by [level][node]. All nodes start with
  // `empty`. combine(node, value) merges the value of a cell into its leaf, and the value of a
  // child into its parent. Leaves must have a fixed size.
  template <typename Value, typename Combine>
  std::vector<std::vector<Value>> summarize(std::span<const Value> of_places, const Value& empty,
                                            const Combine& combine) const {
    std::vector<std::vector<Value>> nodes;
    for (std::span<const Value> below = of_places; nodes.size() < n_levels();) {
      const std::size_t fan_out = nodes.empty() ? leaf_size_ : kFanOut;
      std::vector<Value>& level = nodes.emplace_back(levels_[nodes.size()].size(), empty);
      for (std::size_t node = 0; node < level.size(); ++node) {
        const std::size_t end = std::min((node + 1) * fan_out, below.size());
        for (std::size_t i = node * fan_out; i < end; ++i) combine(level[node], below[i]);
      }
      below = level;
    }
    return nodes;
  }

  // Calls visit(leaf) for each leaf if is_wanted(level, index) is true for the leaf and all of its
  // ancestors. The condition may change between visits.
  template <typename IsWanted, typename Visit>
  void visit_leaves(const IsWanted& is_wanted, const Visit& visit) const {
    if (!empty()) visit_below(n_levels() - 1, 0, is_wanted, visit);
  }

  // Calls visit(begin, end) with the cells of each leaf whose distance is at most `limit`. The
  // children of a node are visited from the nearest to the farthest. visit() may decrease the
  // limit. distance(level, index) must return a lower bound of the distance to all cells in a node,
  // or NaN to skip the node.
  template <typename Distance, typename Visit>
  void visit_nearest(const Distance& distance, const double& limit, const Visit& visit) const {
    if (empty() || !(distance(n_levels() - 1, 0) <= limit)) return;
    visit_nearest_below(n_levels() - 1, 0, distance, limit, visit);
  }

 private:
  template <typename BoxOf>
  void add_levels(std::size_t n_leaves, const BoxOf& box_of, ThreadTeam& team) {
    levels_.emplace_back(n_leaves);
    team.for_each_index(std::ssize(levels_[0]), [&](std::int64_t leaf) {
      const auto [first, last] = places(leaf);
      for (auto place = first; place < last; ++place) levels_[0][leaf].include(box_of(place));
    });
    while (levels_.back().size() > 1) {
      const std::vector<Box>& below = levels_.back();
      std::vector<Box> nodes((below.size() + kFanOut - 1) / kFanOut);
      for (std::size_t child = 0; child < below.size(); ++child) {
        nodes[child / kFanOut].include(below[child]);
      }
      levels_.push_back(std::move(nodes));
    }
  }

  template <typename IsWanted, typename Visit>
  void visit_below(std::size_t level, std::size_t index, const IsWanted& is_wanted,
                   const Visit& visit) const {
    if (!is_wanted(level, index)) return;
    if (level == 0) return visit(index);
    const auto [begin, end] = children(level, index);
    for (auto child = begin; child < end; ++child) visit_below(level - 1, child, is_wanted, visit);
  }

  template <typename Distance, typename Visit>
  void visit_nearest_below(std::size_t level, std::size_t index, const Distance& distance,
                           const double& limit, const Visit& visit) const {
    if (level == 0) {
      const auto [begin, end] = places(index);
      return visit(begin, end);
    }
    // Pairs (distance, child), sorted by distance.
    std::array<std::pair<double, std::size_t>, kFanOut> open;
    std::size_t n_open = 0;
    const auto [begin, end] = children(level, index);
    for (auto child = begin; child < end; ++child) {
      const double apart = distance(level - 1, child);
      if (!(apart <= limit)) continue;
      std::size_t slot = n_open++;
      for (; slot > 0 && apart < open[slot - 1].first; --slot) open[slot] = open[slot - 1];
      open[slot] = {apart, child};
    }
    for (std::size_t i = 0; i < n_open && open[i].first <= limit; ++i) {
      visit_nearest_below(level - 1, open[i].second, distance, limit, visit);
    }
  }

  std::size_t n_cells_ = 0;
  std::size_t leaf_size_ = kLeaf;
  std::vector<Place>
      // First cell of each leaf, followed by the number of cells; empty if all leaves have the same
      // size.
      starts_;
  std::vector<std::vector<Box>> levels_;
};

}  // namespace superfacets
