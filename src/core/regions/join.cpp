#include "regions/join.hpp"

#include <functional>
#include <map>
#include <numeric>
#include <queue>
#include <set>

namespace superfacets {
namespace {

// Neighbors of a group of joined regions, with the cost of each border. Neighbors can be looked up
// by group, and visited in descending order of cost.
class Neighbors {
 public:
  bool empty() const { return costs_.empty(); }
  std::size_t size() const { return costs_.size(); }
  const std::map<Label, double>& costs() const { return costs_; }

  // The neighbor with the highest border cost, or the neighbor with the lowest number if several
  // costs are equal.
  Label preferred() const { return ranking_.begin()->second; }

  void add(Label group, double cost) {
    const auto [place, is_new] = costs_.try_emplace(group, 0.0);
    if (!is_new) ranking_.erase({-place->second, group});
    place->second += cost;
    ranking_.emplace(-place->second, group);
  }

  void remove(Label group) {
    const auto place = costs_.find(group);
    if (place == costs_.end()) return;
    ranking_.erase({-place->second, group});
    costs_.erase(place);
  }

  void clear() {
    costs_.clear();
    ranking_.clear();
  }

 private:
  std::map<Label, double> costs_;
  std::set<std::pair<double, Label>> ranking_;
};

// Groups of joined regions. A group has a number, which identifies it in the lists of neighbors,
// and a label, which is the label of the region that the other regions joined. The number and the
// label differ if another region of the group had more neighbors.
class Groups {
 public:
  Groups(std::span<const double> areas, std::span<const RegionBorder> borders, const JoinRule& rule)
      : rule_(rule),
        areas_(areas.begin(), areas.end()),
        labels_(areas.size()),
        joined_to_(areas.size()),
        is_alive_(areas.size(), 1),
        neighbors_(areas.size()) {
    std::iota(labels_.begin(), labels_.end(), 0);
    std::iota(joined_to_.begin(), joined_to_.end(), 0);
    for (const RegionBorder& border : borders) {
      neighbors_[border.low].add(border.high, border.cost);
      neighbors_[border.high].add(border.low, border.cost);
    }
    for (Label group = 0; std::cmp_less(group, areas.size()); ++group) offer(group);
  }

  void join_all() {
    while (!queue_.empty()) {
      const auto [area, label, group] = queue_.top();
      queue_.pop();
      const bool is_outdated = is_alive_[group] == 0 || areas_[group] != area;
      if (is_outdated || labels_[group] != label || neighbors_[group].empty()) continue;
      join(group, neighbors_[group].preferred());
    }
  }

  // The label of the group of each region.
  std::vector<Label> roots() {
    for (Label label = 0; std::cmp_less(label, joined_to_.size()); ++label) {
      Label root = label;
      while (joined_to_[root] != root) root = joined_to_[root];
      // Path compression: all nodes on the path now point to the root.
      for (Label next = label; next != root;) next = std::exchange(joined_to_[next], root);
    }
    return std::move(joined_to_);
  }

 private:
  struct Candidate {
    double area;
    Label label;
    Label group;
    auto operator<=>(const Candidate&) const = default;
  };

  void offer(Label group) {
    const Label label = labels_[group];
    const bool stays = !rule_.stays.empty() && rule_.stays[label] != 0;
    if (!stays && areas_[group] < rule_.least_area) queue_.push({areas_[group], label, group});
  }

  void join(Label group, Label target) {
    joined_to_[labels_[group]] = labels_[target];
    const Label label = labels_[target];
    const double area = areas_[target] + areas_[group];
    const bool is_larger = neighbors_[group].size() > neighbors_[target].size();
    const auto [kept, gone] = is_larger ? std::pair(group, target) : std::pair(target, group);
    neighbors_[kept].remove(gone);
    for (const auto& [neighbor, cost] : neighbors_[gone].costs()) {
      if (neighbor == kept) continue;
      neighbors_[neighbor].remove(gone);
      neighbors_[neighbor].add(kept, cost);
      neighbors_[kept].add(neighbor, cost);
    }
    neighbors_[gone].clear();
    is_alive_[gone] = 0;
    labels_[kept] = label;
    areas_[kept] = area;
    offer(kept);
  }

  const JoinRule rule_;
  std::vector<double> areas_;           // total area of each group
  std::vector<Label> labels_;           // label of each group
  std::vector<Label> joined_to_;        // region that each region joined, or the region itself
  std::vector<std::uint8_t> is_alive_;  // 1 if the group has not joined another group
  std::vector<Neighbors> neighbors_;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

bool are_valid(std::span<const RegionBorder> borders, Label n_regions) {
  const auto is_valid = [&](const RegionBorder& border) {
    return border.low >= 0 && border.low < border.high && border.high < n_regions;
  };
  const auto is_before = [](const RegionBorder& a, const RegionBorder& b) {
    return std::pair(a.low, a.high) < std::pair(b.low, b.high);
  };
  return std::ranges::all_of(borders, is_valid) && std::ranges::is_sorted(borders, is_before);
}

}  // namespace

std::vector<Label> join_regions(std::span<const double> areas,
                                std::span<const RegionBorder> borders, const JoinRule& rule) {
  SUPERFACETS_ASSERT(rule.stays.empty() || rule.stays.size() == areas.size());
  SUPERFACETS_ASSERT(are_valid(borders, static_cast<Label>(areas.size())));
  Groups groups(areas, borders, rule);
  groups.join_all();
  return groups.roots();
}

}  // namespace superfacets
