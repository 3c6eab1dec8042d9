#include "regions/merge_tree.hpp"

#include <functional>
#include <map>
#include <numbers>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// The border between a group and one of its neighbors.
struct SharedBorder {
  double length = 0.0;
  double cost = 0.0;

  void add(const SharedBorder& other) {
    length += other.length;
    cost += other.cost;
  }
};

// Two nodes that may merge. Candidates are compared member by member.
struct Candidate {
  double cost;
  double tie;  // second sort key, for equal costs
  Label low;
  Label high;

  auto operator<=>(const Candidate&) const = default;
};

// Groups of merged regions. Each group has a node in the tree, and a slot in which its data is
// stored. A merge reuses the slot of the group with more neighbors, so that the longer list of
// neighbors is not copied.
class MergingGroups {
 public:
  MergingGroups(const MergeRegions& regions, const MergeRule& rule)
      : rule_(rule),
        n_features_(regions.areas.empty() ? 0 : regions.features.size() / regions.areas.size()),
        areas_(regions.areas.begin(), regions.areas.end()),
        positions_(regions.positions.begin(), regions.positions.end()),
        features_(regions.features.begin(), regions.features.end()),
        neighbors_(areas_.size()),
        nodes_(areas_.size()) {
    std::iota(nodes_.begin(), nodes_.end(), 0);
    slots_ = nodes_;
    for (const MergeBorder& border : regions.borders) {
      neighbors_[border.low][border.high] = {border.length, border.cost};
      neighbors_[border.high][border.low] = {border.length, border.cost};
    }
    offer_all();
  }

  MergeTree merge_all() {
    while (!queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      // Skips a pair if one of its nodes has been merged in the meantime.
      if (slots_[next.low] == kNoLabel || slots_[next.high] == kNoLabel) continue;
      tree_.children.insert(tree_.children.end(), {next.low, next.high});
      tree_.costs.push_back(next.cost);
      merge(slots_[next.low], slots_[next.high]);
    }
    return std::move(tree_);
  }

 private:
  using Neighbors = std::map<Label, SharedBorder>;  // key: slot of the neighbor

  // Merges two slots into the slot with more neighbors. `first` is the slot of the lower node.
  void merge(Label first, Label second) {
    mix(first, second);
    const bool is_larger = neighbors_[second].size() > neighbors_[first].size();
    const auto [kept, gone] = is_larger ? std::pair(second, first) : std::pair(first, second);
    move_measures(first, kept);
    neighbors_[kept].erase(gone);
    for (const auto& [neighbor, border] : std::exchange(neighbors_[gone], {})) {
      if (neighbor == kept) continue;
      neighbors_[neighbor].erase(gone);
      neighbors_[neighbor][kept].add(border);
      neighbors_[kept][neighbor].add(border);
    }
    slots_[nodes_[kept]] = kNoLabel;
    slots_[nodes_[gone]] = kNoLabel;
    nodes_[kept] = static_cast<Label>(slots_.size());
    slots_.push_back(kept);
    if (queue_.size() > largest_queue_) return offer_all();
    for (const auto& [neighbor, border] : neighbors_[kept]) offer(kept, neighbor, border);
  }

  // Rebuilds the queue without outdated candidates. Each merge makes the candidates of the two
  // merged groups outdated.
  void offer_all() {
    queue_ = {};
    for (Label slot = 0; std::cmp_less(slot, neighbors_.size()); ++slot) {
      for (const auto& [neighbor, border] : neighbors_[slot]) {
        if (slot < neighbor) offer(slot, neighbor, border);
      }
    }
    largest_queue_ = kMaxOutdated * (queue_.size() + 1);
  }

  // Sets the area of the first slot to the sum of both areas, and its position and features to the
  // area-weighted means.
  void mix(Label first, Label second) {
    const double area = areas_[first] + areas_[second];
    const double fraction = area > 0.0 ? areas_[second] / area : 0.5;
    positions_[first] = positions_[first] + fraction * (positions_[second] - positions_[first]);
    for (std::size_t f = 0; f < n_features_; ++f) {
      double& feature = features_[first * n_features_ + f];
      feature += fraction * (features_[second * n_features_ + f] - feature);
    }
    areas_[first] = area;
  }

  void move_measures(Label from, Label to) {
    if (from == to) return;
    areas_[to] = areas_[from];
    positions_[to] = positions_[from];
    const auto row = features_.begin() + static_cast<std::ptrdiff_t>(from * n_features_);
    std::copy_n(row, n_features_,
                features_.begin() + static_cast<std::ptrdiff_t>(to * n_features_));
  }

  void offer(Label a, Label b, const SharedBorder& border) {
    const auto [low, high] = std::minmax(nodes_[a], nodes_[b]);
    const double cost = cost_of(slots_[low], slots_[high], border);
    if (n_features_ == 0) return queue_.push({cost, 0.0, low, high});
    queue_.push({cost_of_features(slots_[low], slots_[high]), cost, low, high});
  }

  double cost_of(Label a, Label b, const SharedBorder& border) const {
    const double factor = ward_factor(a, b);
    if (!(factor > 0.0)) return 0.0;
    const double radius = radius_of(areas_[a] + areas_[b]);
    const bool is_gap = !(border.length > 0.0);
    const double openness = is_gap ? 0.0 : border.cost / border.length;
    const double length =
        is_gap ? (rule_.dimension == 2 ? radius : radius * radius) : border.length;
    const double distance = norm(positions_[a] - positions_[b]);
    return factor * (distance + rule_.crease_weight * radius * (1.0 - openness)) / length;
  }

  double cost_of_features(Label a, Label b) const {
    double squared = 0.0;
    for (std::size_t f = 0; f < n_features_; ++f) {
      const double step = features_[a * n_features_ + f] - features_[b * n_features_ + f];
      squared += step * step;
    }
    return ward_factor(a, b) * squared;
  }

  // The factor a b / (a + b) in Ward's cost of merging areas a and b. The cost is this factor times
  // the squared distance of the two means.
  double ward_factor(Label a, Label b) const {
    const double area = areas_[a] + areas_[b];
    return area > 0.0 ? areas_[a] / area * areas_[b] : 0.0;
  }

  double radius_of(double area) const {
    if (rule_.dimension == 2) return std::sqrt(area / std::numbers::pi);
    return std::cbrt(0.75 * area / std::numbers::pi);
  }

  // The queue is rebuilt when it has grown by this factor.
  static constexpr std::size_t kMaxOutdated = 8;

  const MergeRule rule_;
  const std::size_t n_features_;
  std::vector<double> areas_;         // area of the group in each slot
  std::vector<Point> positions_;      // mean position of the group in each slot
  std::vector<double> features_;      // mean features of the group in each slot
  std::vector<Neighbors> neighbors_;  // neighbors of the group in each slot
  std::vector<Label> nodes_;          // tree node of the group in each slot
  std::vector<Label> slots_;          // slot of each node; kNoLabel after the node has been merged
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
  std::size_t largest_queue_ = 0;  // maximum size of the queue before it is rebuilt
  MergeTree tree_;
};

bool are_valid(const MergeRegions& regions) {
  const std::size_t n_regions = regions.areas.size();
  const auto is_valid = [&](const MergeBorder& border) {
    return border.low >= 0 && border.low < border.high && std::cmp_less(border.high, n_regions) &&
           border.cost >= 0.0 && border.length >= 0.0;
  };
  const auto is_before = [](const MergeBorder& a, const MergeBorder& b) {
    return std::tie(a.low, a.high) < std::tie(b.low, b.high);
  };
  return regions.positions.size() == n_regions &&
         (n_regions == 0 || regions.features.size() % n_regions == 0) &&
         std::ranges::all_of(regions.borders, is_valid) &&
         std::ranges::is_sorted(regions.borders, is_before);
}

}  // namespace

MergeTree merge_tree(const MergeRegions& regions, const MergeRule& rule) {
  SUPERFACETS_ASSERT(are_valid(regions));
  return MergingGroups(regions, rule).merge_all();
}

}  // namespace superfacets
