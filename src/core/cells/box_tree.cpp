#include "cells/box_tree.hpp"

namespace superfacets {

BoxTree::BoxTree(std::span<const Point> positions, ThreadTeam& team) : n_cells_(positions.size()) {
  std::vector<Box> leaves((n_cells_ + kLeaf - 1) / kLeaf);
  auto build_leaves = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t leaf = begin; leaf < end; ++leaf) {
      const auto [first, last] = places(leaf);
      for (auto place = first; place < last; ++place) leaves[leaf].include(positions[place]);
    }
  };
  team.for_each_block(static_cast<std::int64_t>(leaves.size()), build_leaves);
  levels_.push_back(std::move(leaves));
  while (levels_.back().size() > 1) {
    const std::vector<Box>& below = levels_.back();
    std::vector<Box> nodes((below.size() + kFanOut - 1) / kFanOut);
    for (std::size_t child = 0; child < below.size(); ++child) {
      nodes[child / kFanOut].include(below[child]);
    }
    levels_.push_back(std::move(nodes));
  }
}

}  // namespace superfacets
