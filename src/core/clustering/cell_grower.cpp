#include "clustering/cell_grower.hpp"

namespace superfacets {
namespace {

// Prefetch distance: arcs are prefetched this number of cells in advance.
constexpr std::size_t kArcsAhead = 16;

}  // namespace

void CellGrower::divide(Place begin, Place end) {
  SUPERFACETS_ASSERT(begin < end && end <= graph_.n_cells());
  SUPERFACETS_ASSERT(end - begin <= 1 << kRangeBits);
  begin_ = begin;
  size_ = end - begin;
  centers_.clear();
  paths_.assign(size_ + 1, kNoPath);
  paths_[size_] = 0;
  if (graph_.straight_unit > 0.0) costs_.assign(size_, 0.0F);
  is_waiting_.assign(size_, 0);
  const auto spacing = static_cast<std::size_t>(spacing_);
  for (std::size_t i = (std::min(spacing, size_) - 1) / 2; i < size_; i += spacing) {
    start(begin + static_cast<Place>(i));
  }
  expand_waiting();
  for (Place place = begin; place < end; ++place) {
    if (paths_[index_of(place)] != kNoPath) continue;
    start(place);
    expand_waiting();
  }
}

void CellGrower::start(Place center) {
  paths_[index_of(center)] = centers_.size();
  waiting_.push_back(index_of(center));
  centers_.push_back(center);
}

// Label-correcting search: each round extends all improved paths by one arc. Coarse cells are a few
// arcs wide, so a few rounds suffice.
void CellGrower::expand_waiting() {
  std::size_t n_expanded = 0;
  while (!waiting_.empty()) {
    n_expanded += waiting_.size();
    if (n_expanded > kMaxExpanded * size_) return expand_in_order();
    for (std::size_t next = 0; next < waiting_.size(); ++next) {
      if (next + kArcsAhead < waiting_.size()) prefetch_arcs(waiting_[next + kArcsAhead]);
      is_waiting_[waiting_[next]] = 0;
      expand(waiting_[next], [&](std::size_t to) {
        if (std::exchange(is_waiting_[to], 1) == 0) next_.push_back(to);
      });
    }
    waiting_.clear();
    std::swap(waiting_, next_);
  }
}

// Runs Dijkstra's algorithm, starting from all waiting cells.
void CellGrower::expand_in_order() {
  heap_.restart();
  auto push = [&](std::size_t i) { heap_.push(paths_[i], static_cast<Place>(i)); };
  for (const std::size_t i : waiting_) {
    is_waiting_[i] = 0;
    push(i);
  }
  waiting_.clear();
  while (!heap_.empty()) {
    const auto [path, i] = heap_.pop();
    if (path == paths_[i]) expand(i, push);
  }
}

void CellGrower::prefetch_arcs(std::size_t index) const {
  graph_.arcs_of(begin_ + static_cast<Place>(index)).prefetch();
}

template <typename Push>
void CellGrower::expand(std::size_t index, const Push& push) {
  const PackedPath path = paths_[index];
  const bool has_costs = graph_.straight_unit > 0.0;
  const auto extend = [&](std::size_t, Arc arc) {
    const auto length = static_cast<PathLength>(static_cast<std::int64_t>(arc.length));
    const PackedPath longer = path + (length << kRangeBits);
    const std::size_t to = index_of(arc.to);
    if (longer >= paths_[to]) return;
    if (has_costs) {
      const double cost = graph_.crease_cost(begin_ + static_cast<Place>(index), arc);
      if (cost >= graph_.crease_limit) return;
      costs_[to] = costs_[index] + static_cast<float>(cost);
    }
    paths_[to] = longer;
    push(to);
  };
  graph_.arcs_of(begin_ + static_cast<Place>(index)).for_each(extend);
}

}  // namespace superfacets
