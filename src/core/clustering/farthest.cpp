#include "clustering/farthest.hpp"

namespace superfacets {
namespace {

// Initial value of a maximum, less than every squared distance and less than kIsCenter.
constexpr double kBelowAll = -2.0;

// Position of a center that is farther away than all other centers.
constexpr Point kNowhere{kInfinity, kInfinity, kInfinity};

// Tree level whose nodes are updated on several threads, if a new center may change at least
// kMinShared of these nodes. A node of this level contains 2^11 cells, and updating it takes about
// ten microseconds.
constexpr std::size_t kSharedLevel = 2;
constexpr std::size_t kMinShared = 8;

}  // namespace

FarthestPoints::FarthestPoints(const OrderedGraph& graph, ThreadTeam& team)
    : graph_(graph), team_(team), squared_distance_(graph.n_cells()) {
  team.fill(squared_distance_.span(), kInfinity);
  for (std::size_t level = 0; level < graph_.tree.n_levels(); ++level) {
    summaries_.emplace_back(graph_.tree.level(level).size());
  }
  summarize_all();
}

void FarthestPoints::summarize_all() {
  for (std::size_t level = 0; level < summaries_.size(); ++level) {
    team_.for_each_index(std::ssize(summaries_[level]),
                         [&](std::size_t index) { summarize(level, index); });
  }
}

Place FarthestPoints::farthest() const {
  const Summary& all = summaries_.back().front();
  SUPERFACETS_ASSERT(all.farthest_squared > kIsCenter);
  return all.farthest;
}

void FarthestPoints::place(Place center) {
  squared_distance_[center] = kIsCenter;
  const Point position = graph_.positions[center];
  const std::size_t top = graph_.tree.n_levels() - 1;
  update_all(top, position);
  std::size_t index = center / BoxTree::kLeaf;
  for (std::size_t level = 0; level <= top; ++level, index /= BoxTree::kFanOut) {
    summarize(level, index);
  }
}

void FarthestPoints::update_all(std::size_t top, Point position) {
  if (team_.size() == 1 || top < kSharedLevel) return update(top, 0, position);
  std::vector<std::size_t> changing;
  find_changing(top, 0, position, changing);
  if (changing.size() < kMinShared) return update(top, 0, position);
  team_.for_each(std::ssize(changing),
                 [&](std::int64_t task, int) { update(kSharedLevel, changing[task], position); });
  for (std::size_t level = kSharedLevel + 1; level <= top; ++level) {
    for (std::size_t& index : changing) index /= BoxTree::kFanOut;
    changing.erase(std::unique(changing.begin(), changing.end()), changing.end());
    for (const std::size_t index : changing) summarize(level, index);
  }
}

// Lists the nodes of level kSharedLevel that a new center may change, in ascending order.
void FarthestPoints::find_changing(std::size_t level, std::size_t index, Point center,
                                   std::vector<std::size_t>& changing) const {
  if (!can_change(level, index, center)) return;
  if (level == kSharedLevel) return changing.push_back(index);
  const auto [begin, end] = graph_.tree.children(level, index);
  for (auto child = begin; child < end; ++child) find_changing(level - 1, child, center, changing);
}

// Whether a new center may change a distance in a node. No distance changes if every point in the
// node's box is farther from the new center than every cell in the node is from its nearest center.
bool FarthestPoints::can_change(std::size_t level, std::size_t index, Point center) const {
  return summaries_[level][index].farthest_squared >
         graph_.tree.level(level)[index].squared_distance(center);
}

void FarthestPoints::update(std::size_t level, std::size_t index, Point center) {
  if (!can_change(level, index, center)) return;
  if (level == 0) return update_leaf(index, center);
  const auto [begin, end] = graph_.tree.children(level, index);
  for (auto child = begin; child < end; ++child) update(level - 1, child, center);
  summarize(level, index);
}

void FarthestPoints::update_leaf(std::size_t leaf, Point center) {
  const auto [begin, end] = graph_.tree.places(leaf);
  Summary summary{kBelowAll, static_cast<Place>(begin)};
  for (auto place = begin; place < end; ++place) {
    const double squared =
        std::min(squared_distance_[place], squared_norm(graph_.positions[place] - center));
    squared_distance_[place] = squared;
    if (squared < summary.farthest_squared) continue;
    const Summary other{squared, static_cast<Place>(place)};
    if (is_farther(other, summary)) summary = other;
  }
  summaries_.front()[leaf] = summary;
}

bool FarthestPoints::is_farther(const Summary& a, const Summary& b) const {
  return a.farthest_squared > b.farthest_squared ||
         (a.farthest_squared == b.farthest_squared &&
          graph_.cell_at(a.farthest) < graph_.cell_at(b.farthest));
}

void FarthestPoints::summarize(std::size_t level, std::size_t index) {
  if (level == 0) return update_leaf(index, kNowhere);
  const auto [begin, end] = graph_.tree.children(level, index);
  const auto children = std::span(summaries_[level - 1]).subspan(begin, end - begin);
  summaries_[level][index] = *std::ranges::max_element(
      children, [&](const Summary& a, const Summary& b) { return is_farther(b, a); });
}

}  // namespace superfacets
