// A tree of bounding boxes over the cells in their order on the space-filling curve.
#pragma once

#include <vector>

#include "base/assert.hpp"
#include "base/box.hpp"
#include "base/threads.hpp"

namespace superfacets {

// A leaf holds consecutive places on the curve, kLeaf by default; a node has kFanOut children in
// the level below.
class BoxTree {
 public:
  static constexpr std::size_t kLeaf = 32;   // positions of a leaf fill twelve cache lines
  static constexpr std::size_t kFanOut = 8;  // a cube on a Morton curve has eight octants

  BoxTree() = default;  // an empty tree

  // Builds a tree over points, given in their order on the curve.
  BoxTree(std::span<const Point> positions, ThreadTeam& team);

  // Builds a tree over cells with an extent. box_of(place) returns the box of a cell; it is called
  // once for each place, on any thread.
  template <typename BoxOf>
  BoxTree(std::size_t n_cells, std::size_t leaf_size, const BoxOf& box_of, ThreadTeam& team)
      : n_cells_(n_cells), leaf_size_(leaf_size) {
    std::vector<Box> leaves((n_cells + leaf_size - 1) / leaf_size);
    team.for_each_index(static_cast<std::int64_t>(leaves.size()), [&](std::int64_t leaf) {
      const auto [first, last] = places(leaf);
      for (auto place = first; place < last; ++place) leaves[leaf].include(box_of(place));
    });
    build_nodes(std::move(leaves));
  }

  // Number of levels. The first level holds the leaves, the last only the root.
  std::size_t n_levels() const { return levels_.size(); }
  std::span<const Box> level(std::size_t level) const { return levels_[level]; }

  // The children of a node above the leaves: first, and one past the last.
  std::pair<std::size_t, std::size_t> children(std::size_t level, std::size_t index) const {
    SUPERFACETS_ASSERT(level > 0 && level < n_levels() && index < levels_[level].size());
    return {index * kFanOut, std::min((index + 1) * kFanOut, levels_[level - 1].size())};
  }
  // The places of a leaf: first, and one past the last.
  std::pair<std::size_t, std::size_t> places(std::size_t leaf) const {
    SUPERFACETS_ASSERT(leaf * leaf_size_ < n_cells_);
    return {leaf * leaf_size_, std::min((leaf + 1) * leaf_size_, n_cells_)};
  }

  // Calls visit(begin, end), with the range of places, for each leaf if is_wanted(level, index)
  // holds for the leaf and all of its ancestors. The condition may change between visits.
  template <typename IsWanted, typename Visit>
  void visit_leaves(const IsWanted& is_wanted, const Visit& visit) const {
    visit_below(n_levels() - 1, 0, is_wanted, visit);
  }

 private:
  // Adds the leaves, and the levels above them.
  void build_nodes(std::vector<Box> leaves);

  template <typename IsWanted, typename Visit>
  void visit_below(std::size_t level, std::size_t index, const IsWanted& is_wanted,
                   const Visit& visit) const {
    if (!is_wanted(level, index)) return;
    if (level == 0) {
      const auto [begin, end] = places(index);
      return visit(begin, end);
    }
    const auto [begin, end] = children(level, index);
    for (auto child = begin; child < end; ++child) visit_below(level - 1, child, is_wanted, visit);
  }

  std::size_t n_cells_ = 0;
  std::size_t leaf_size_ = kLeaf;
  std::vector<std::vector<Box>> levels_;
};

}  // namespace superfacets
