#include "clustering/islands.hpp"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <tuple>
#include <vector>

#include "cells/box_tree.hpp"
#include "cells/components.hpp"

namespace superfacets {
namespace {

// Number of islands that one task searches from.
constexpr std::int64_t kBlock = 1 << 10;

// A labeled cell and its distance.
struct Candidate {
  double squared_distance = kInfinity;
  Cell cell = 0;
  Label label = kNoLabel;

  bool is_better_than(const Candidate& other) const {
    return std::tie(squared_distance, cell) < std::tie(other.squared_distance, other.cell);
  }
};

// A tree of boxes of the labeled cells alone. A search in the tree of all cells would visit
// everything between an island and the nearest labeled cell, possibly thousands of other islands.
class LabeledCells {
 public:
  LabeledCells(const OrderedGraph& graph, std::span<const Label> labels, ThreadTeam& team) {
    for (Place place = 0; place < graph.n_cells(); ++place) {
      if (labels[place] == kNoLabel) continue;
      places_.push_back(place);
      positions_.push_back(graph.positions[place]);
      cells_.push_back(graph.cells[place]);
      labels_.push_back(labels[place]);
    }
    tree_ = BoxTree(positions_, team);
    find_lowest();
  }

  // Updates the best candidate found from other cells of the same island.
  void search(Point target, Place place, Candidate& best) const {
    // The nearest cell along the curve is usually near in space; boxes farther away are skipped.
    const auto next = std::lower_bound(places_.begin(), places_.end(), place) - places_.begin();
    const auto n = static_cast<std::int64_t>(places_.size());
    compare(target, std::min<std::int64_t>(next, n - 1), best);
    compare(target, std::max<std::int64_t>(next - 1, 0), best);
    auto may_improve = [&](std::size_t level, std::size_t index) {
      const double squared = tree_.level(level)[index].squared_distance(target);
      return squared < best.squared_distance ||
             (squared == best.squared_distance && lowest_[level][index] < best.cell);
    };
    tree_.visit_leaves(may_improve, [&](std::size_t begin, std::size_t end) {
      for (auto i = begin; i < end; ++i) compare(target, static_cast<std::int64_t>(i), best);
    });
  }

 private:
  void compare(Point target, std::int64_t i, Candidate& best) const {
    const Candidate other{squared_norm(positions_[i] - target), cells_[i], labels_[i]};
    if (other.is_better_than(best)) best = other;
  }

  void find_lowest() {
    for (std::size_t level = 0; level < tree_.n_levels(); ++level) {
      const auto& below = level == 0 ? cells_ : lowest_[level - 1];
      const std::size_t fan_out = level == 0 ? BoxTree::kLeaf : BoxTree::kFanOut;
      std::vector<Cell> lowest(tree_.level(level).size(), std::numeric_limits<Cell>::max());
      for (std::size_t i = 0; i < below.size(); ++i) {
        lowest[i / fan_out] = std::min(lowest[i / fan_out], below[i]);
      }
      lowest_.push_back(std::move(lowest));
    }
  }

  std::vector<Place> places_;  // ascending
  std::vector<Point> positions_;
  std::vector<Cell> cells_;
  std::vector<Label> labels_;
  BoxTree tree_;
  std::vector<std::vector<Cell>> lowest_;  // of each node, as in the tree
};

// The cells without a label, grouped by island.
std::vector<Place> unlabeled_places(std::span<const Label> labels, const Components& pieces) {
  std::vector<Place> places;
  for (Place place = 0; std::cmp_less(place, labels.size()); ++place) {
    if (labels[place] == kNoLabel) places.push_back(place);
  }
  std::stable_sort(places.begin(), places.end(),
                   [&](Place a, Place b) { return pieces.of[a] < pieces.of[b]; });
  return places;
}

// The nearest labeled cell of each island, by component.
std::vector<Candidate> nearest_of(const OrderedGraph& graph, const LabeledCells& labeled,
                                  std::span<const Place> places, const Components& pieces,
                                  ThreadTeam& team) {
  std::vector<Candidate> nearest(pieces.n_components);
  std::mutex mutex;
  auto search_range = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end;) {
      const Cell piece = pieces.of[places[i]];
      Candidate best;  // from the cells of the island in this block
      for (; i < end && pieces.of[places[i]] == piece; ++i) {
        labeled.search(graph.positions[places[i]], places[i], best);
      }
      const std::scoped_lock lock(mutex);
      if (best.is_better_than(nearest[piece])) nearest[piece] = best;
    }
  };
  team.for_each_block(static_cast<std::int64_t>(places.size()), search_range, kBlock);
  return nearest;
}

}  // namespace

JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team) {
  JoinedIslands joined{Buffer<Label>(labels.size()), 0};
  std::copy(labels.begin(), labels.end(), joined.labels.begin());
  if (std::find(labels.begin(), labels.end(), kNoLabel) == labels.end()) return joined;
  Buffer<Label> by_place(labels.size());
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) by_place[graph.place_of[cell]] = labels[cell];
  const Components pieces = find_components(graph, by_place.span());
  const std::vector<Place> places = unlabeled_places(by_place.span(), pieces);
  const LabeledCells labeled(graph, by_place.span(), team);
  const auto nearest = nearest_of(graph, labeled, places, pieces, team);
  for (const Place place : places) {
    joined.labels[graph.cells[place]] = nearest[pieces.of[place]].label;
  }
  joined.n_islands = static_cast<Cell>(
      std::count_if(nearest.begin(), nearest.end(),
                    [](const Candidate& candidate) { return candidate.label != kNoLabel; }));
  return joined;
}

}  // namespace superfacets
