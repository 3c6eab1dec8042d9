#include "farthest.hpp"

#include <algorithm>
#include <limits>

#include "morton.hpp"

namespace superfacets {
namespace {

constexpr std::size_t kLeafSize = 32;  // cells in a leaf: its positions fill twelve cache lines
constexpr std::size_t kFanOut = 8;     // an octant's share of a Morton curve
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Below every squared distance, so that a center is never the farthest cell again.
constexpr double kIsCenter = -1.0;

double gap(double low, double high, double value) {
  return std::max({low - value, 0.0, value - high});
}

// A lower bound of the squared distance from a point to anything in a box. It is one in floating
// point too: rounding is monotone, and the terms are added in the order of squared_norm.
double squared_distance_to_box(Point low, Point high, Point p) {
  return squared_norm({gap(low.x, high.x, p.x), gap(low.y, high.y, p.y), gap(low.z, high.z, p.z)});
}

bool is_farther(double squared_a, Cell a, double squared_b, Cell b) {
  return squared_a > squared_b || (squared_a == squared_b && a < b);
}

}  // namespace

FarthestPoints::FarthestPoints(std::span<const Point> positions)
    : cells_(morton_order(positions)), place_of_(positions.size()) {
  positions_.reserve(cells_.size());
  for (std::size_t place = 0; place < cells_.size(); ++place) {
    positions_.push_back(positions[cells_[place]]);
    place_of_[cells_[place]] = place;
  }
  squared_distance_.assign(cells_.size(), kInfinity);
  build_leaves(positions_);
  while (levels_.back().size() > 1) build_level();
}

void FarthestPoints::build_leaves(std::span<const Point> positions) {
  std::vector<Node> leaves;
  for (std::size_t begin = 0; begin < positions.size(); begin += kLeafSize) {
    Node leaf{positions[begin], positions[begin], kInfinity, 0};
    for (const Point& p : positions.subspan(begin, std::min(kLeafSize, positions.size() - begin))) {
      leaf.low = {std::min(leaf.low.x, p.x), std::min(leaf.low.y, p.y), std::min(leaf.low.z, p.z)};
      leaf.high = {std::max(leaf.high.x, p.x), std::max(leaf.high.y, p.y),
                   std::max(leaf.high.z, p.z)};
    }
    leaves.push_back(leaf);
  }
  levels_.push_back(std::move(leaves));
  for (std::size_t leaf = 0; leaf < levels_.front().size(); ++leaf) summarize_leaf(leaf);
}

void FarthestPoints::build_level() {
  const std::vector<Node>& below = levels_.back();
  std::vector<Node> nodes;
  for (std::size_t begin = 0; begin < below.size(); begin += kFanOut) {
    Node node = below[begin];
    for (std::size_t child = begin; child < std::min(begin + kFanOut, below.size()); ++child) {
      const auto& [low, high, squared, cell] = below[child];
      node.low = {std::min(node.low.x, low.x), std::min(node.low.y, low.y),
                  std::min(node.low.z, low.z)};
      node.high = {std::max(node.high.x, high.x), std::max(node.high.y, high.y),
                   std::max(node.high.z, high.z)};
    }
    nodes.push_back(node);
  }
  levels_.push_back(std::move(nodes));
  const std::size_t level = levels_.size() - 1;
  for (std::size_t index = 0; index < levels_[level].size(); ++index) summarize(level, index);
}

void FarthestPoints::place(Cell center) {
  const std::size_t place = place_of_[center];
  squared_distance_[place] = kIsCenter;
  update(levels_.size() - 1, 0, positions_[place]);
}

Cell FarthestPoints::farthest() const {
  return levels_.back().front().farthest;
}

void FarthestPoints::update(std::size_t level, std::size_t index, Point center) {
  const Node& node = levels_[level][index];
  // Where the box is no nearer than the farthest of its cells is already, nothing can change. A
  // new center itself is always reached: its box is at distance 0 and some cell is farther, or
  // all are centers or coincide with one, and then `<=` lets it in.
  if (node.farthest_squared < squared_distance_to_box(node.low, node.high, center)) return;
  if (level == 0) return update_leaf(index, center);
  const std::size_t end = std::min((index + 1) * kFanOut, levels_[level - 1].size());
  for (std::size_t child = index * kFanOut; child < end; ++child) update(level - 1, child, center);
  summarize(level, index);
}

void FarthestPoints::update_leaf(std::size_t leaf, Point center) {
  const std::size_t end = std::min((leaf + 1) * kLeafSize, cells_.size());
  for (std::size_t place = leaf * kLeafSize; place < end; ++place) {
    squared_distance_[place] =
        std::min(squared_distance_[place], squared_norm(positions_[place] - center));
  }
  summarize_leaf(leaf);
}

void FarthestPoints::summarize_leaf(std::size_t leaf) {
  Node& node = levels_.front()[leaf];
  const std::size_t begin = leaf * kLeafSize;
  const std::size_t end = std::min(begin + kLeafSize, cells_.size());
  node.farthest_squared = squared_distance_[begin];
  node.farthest = cells_[begin];
  for (std::size_t place = begin + 1; place < end; ++place) {
    if (!is_farther(squared_distance_[place], cells_[place], node.farthest_squared, node.farthest))
      continue;
    node.farthest_squared = squared_distance_[place];
    node.farthest = cells_[place];
  }
}

void FarthestPoints::summarize(std::size_t level, std::size_t index) {
  const std::vector<Node>& below = levels_[level - 1];
  const std::size_t begin = index * kFanOut;
  const std::size_t end = std::min(begin + kFanOut, below.size());
  Node& node = levels_[level][index];
  node.farthest_squared = below[begin].farthest_squared;
  node.farthest = below[begin].farthest;
  for (std::size_t child = begin + 1; child < end; ++child) {
    const Node& other = below[child];
    if (!is_farther(other.farthest_squared, other.farthest, node.farthest_squared, node.farthest))
      continue;
    node.farthest_squared = other.farthest_squared;
    node.farthest = other.farthest;
  }
}

}  // namespace superfacets
