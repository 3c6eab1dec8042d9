#include "spatial/box_tree.hpp"

namespace superfacets {

BoxTree::BoxTree(std::span<const Point> positions, ThreadTeam& team)
    : BoxTree(
          positions.size(), kLeaf,
          [&](std::size_t place) { return Box{positions[place], positions[place]}; }, team) {}

void BoxTree::build_nodes(std::vector<Box> leaves) {
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
