#include "clustering/update.hpp"

#include "clustering/nearest_members.hpp"

namespace superfacets {
namespace {

void add_shared(std::int64_t& target, std::int64_t value) {
  std::atomic_ref(target).fetch_add(value, std::memory_order_relaxed);
}

}  // namespace

RegionMeans::RegionMeans(const OrderedGraph& graph, ThreadTeam& team)
    : graph_(graph), team_(team), fixed_(graph), labels_(graph.n_cells()) {
  team.fill(labels_.span(), kNoLabel);
}

void RegionMeans::resize(std::size_t n_regions) {
  sums_.resize(n_regions);
  has_changed_.resize(n_regions, 0);
  nearest_.resize(n_regions, 0);
}

// Consecutive cells mostly change between the same two labels. So the contributions of consecutive
// cells with equal labels are summed first, which saves atomic operations.
void RegionMeans::collect(Change& change, Label label, const FixedSum& sum, std::int64_t sign) {
  if (label != change.label) {
    apply(change, sign);
    change = {label, {}};
  }
  change.sum.add(sum);
}

void RegionMeans::apply(const Change& change, std::int64_t sign) {
  if (change.label == kNoLabel) return;
  FixedSum& sum = sums_[change.label];
  for (int i = 0; i < 4; ++i) {
    add_shared(sum.upper[i], sign * change.sum.upper[i]);
    add_shared(sum.lower[i], sign * change.sum.lower[i]);
  }
  std::atomic_ref(has_changed_[change.label]).store(1, std::memory_order_relaxed);
}

const std::vector<Place>& RegionMeans::nearest(std::span<const Place> members) {
  SUPERFACETS_ASSERT(members.size() == nearest_.size());
  std::vector<Label> changed;
  for (std::size_t label = 0; label < has_changed_.size(); ++label) {
    if (std::exchange(has_changed_[label], 0) == 0) continue;
    if (std::cmp_equal(labels_[members[label]], label)) {
      changed.push_back(static_cast<Label>(label));
    } else {
      nearest_[label] = members[label];
    }
  }
  const std::vector<Point> means = means_of(changed);
  std::vector<Place> places;
  places.reserve(changed.size());
  for (const Label label : changed) places.push_back(members[label]);
  const auto label_of = [&](Place place) { return labels_[place]; };
  find_nearest_members(graph_, changed, means, label_of, places, team_);
  for (std::size_t i = 0; i < changed.size(); ++i) nearest_[changed[i]] = places[i];
  return nearest_;
}

std::vector<Point> RegionMeans::means_of(std::span<const Label> regions) const {
  std::vector<Point> means;
  means.reserve(regions.size());
  std::vector<WeightedSum> small(sums_.size());
  const bool any_small = std::ranges::any_of(
      regions, [&](Label label) { return FixedPoint::is_too_small(sums_[label]); });
  for (Cell cell = 0; any_small && cell < graph_.n_cells(); ++cell) {
    const Place place = graph_.place_of(cell);
    if (labels_[place] == kNoLabel || !FixedPoint::is_too_small(sums_[labels_[place]])) continue;
    small[labels_[place]].add(graph_.positions[place], graph_.measures[place]);
  }
  for (const Label label : regions) {
    const bool is_small = FixedPoint::is_too_small(sums_[label]);
    means.push_back(is_small ? small[label].mean() : fixed_.mean(sums_[label]));
  }
  return means;
}

Point weighted_mean(const OrderedGraph& graph, ThreadTeam& team) {
  if (graph.total_measure > 0.0) {
    const FixedPoint fixed(graph);
    FixedSum total;
    std::mutex mutex;
    auto add_range = [&](std::int64_t begin, std::int64_t end) {
      FixedSum sum;
      for (auto place = static_cast<Place>(begin); place < end; ++place) sum.add(fixed.of(place));
      const std::scoped_lock lock(mutex);
      total.add(sum);
    };
    team.for_each_block(graph.n_cells(), add_range);
    return fixed.mean(total);
  }
  WeightedSum sums;
  for (const Place place : graph.in_input_order()) sums.add(graph.positions[place], 0.0);
  return sums.mean();
}

std::vector<Place> update_centers(const OrderedGraph& graph, std::span<const Label> labels,
                                  Label n_regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph.n_cells()));
  SUPERFACETS_ASSERT(all_below(labels, n_regions));
  RegionMeans means(graph, team);
  means.resize(n_regions);
  auto take_over = [&](std::int64_t begin, std::int64_t end) {
    means.take_over(static_cast<Place>(begin), static_cast<Place>(end),
                    [&](Place place) { return labels[place]; });
  };
  team.for_each_block(graph.n_cells(), take_over);
  std::vector<Place> members(n_regions, kNoPlace);
  for (Place place = 0; place < graph.n_cells(); ++place) members[labels[place]] = place;
  // Every entry is set, because each region has at least one cell.
  SUPERFACETS_ASSERT(all_below(members, graph.n_cells()));
  return means.nearest(members);
}

}  // namespace superfacets
