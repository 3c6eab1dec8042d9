#include "clustering/islands.hpp"

#include "cells/components.hpp"

namespace superfacets {
namespace {

// Number of unlabeled cells per task.
constexpr std::int64_t kBlock = 1 << 10;

// A labeled cell, and its distance from an island. The lowest candidate is the best.
struct Candidate {
  double squared_distance = kInfinity;
  Cell cell = 0;
  Label label = kNoLabel;

  auto operator<=>(const Candidate&) const = default;
};

// A box tree of the labeled cells only. A search in the tree of all cells would also visit the
// cells of other islands, and there may be thousands of such cells near an island.
class LabeledCells {
 public:
  // `labels` is in the sorted order of the graph. `groups` is in the order of the input, or empty.
  LabeledCells(const OrderedGraph& graph, std::span<const Label> labels,
               std::span<const Label> groups, ThreadTeam& team) {
    for (Place place = 0; place < graph.n_cells(); ++place) {
      if (labels[place] == kNoLabel) continue;
      if (!groups.empty()) groups_.push_back(groups[graph.cell_at(place)]);
      places_.push_back(place);
      positions_.push_back(graph.positions[place]);
      cells_.push_back(graph.cell_at(place));
      labels_.push_back(labels[place]);
    }
    tree_ = BoxTree(positions_, team);
    lowest_ = tree_.summarize<Cell>(
        cells_, graph.n_cells(), [](Cell& lowest, Cell cell) { lowest = std::min(lowest, cell); });
    if (groups.empty()) return;
    std::vector<Range> ranges;
    ranges.reserve(groups_.size());
    for (const Label group : groups_) ranges.push_back({group, group});
    ranges_ = tree_.summarize<Range>(
        ranges, {}, [](Range& range, const Range& other) { range.include(other); });
  }

  // Searches for the labeled cell nearest to `target`, the position of a cell of an island that
  // belongs to `group`. `best` is the best candidate found so far, and is replaced by a nearer
  // cell.
  void search(Point target, Place place, Label group, Candidate& best) const {
    // The first candidates are the nearest labeled cells along the space-filling curve. These cells
    // are usually near in space, so that most boxes are farther away and skipped.
    const auto next = std::ranges::lower_bound(places_, place) - places_.begin();
    const auto n = static_cast<std::int64_t>(places_.size());
    compare(target, std::min<std::int64_t>(next, n - 1), group, best);
    compare(target, std::max<std::int64_t>(next - 1, 0), group, best);
    auto may_improve = [&](std::size_t level, std::size_t index) {
      if (group != kAnyGroup && !ranges_[level][index].holds(group)) return false;
      const double squared = tree_.level(level)[index].squared_distance(target);
      return squared < best.squared_distance ||
             (squared == best.squared_distance && lowest_[level][index] < best.cell);
    };
    tree_.visit_leaves(may_improve, [&](std::size_t leaf) {
      const auto [begin, end] = tree_.places(leaf);
      for (auto i = begin; i < end; ++i) compare(target, static_cast<std::int64_t>(i), group, best);
    });
  }

 private:
  // The lowest and highest group of the cells in a box.
  struct Range {
    Label low = std::numeric_limits<Label>::max();
    Label high = std::numeric_limits<Label>::min();

    bool holds(Label group) const { return low <= group && group <= high; }
    void include(const Range& other) {
      low = std::min(low, other.low);
      high = std::max(high, other.high);
    }
  };

  void compare(Point target, std::int64_t i, Label group, Candidate& best) const {
    if (group != kAnyGroup && groups_[i] != group) return;
    best = std::min(best, {squared_norm(positions_[i] - target), cells_[i], labels_[i]});
  }

  std::vector<Place> places_;     // sorted index of each labeled cell, ascending
  std::vector<Point> positions_;  // position of each labeled cell
  std::vector<Cell> cells_;       // input index of each labeled cell
  std::vector<Label> labels_;     // label of each labeled cell
  std::vector<Label> groups_;     // group of each labeled cell; empty if there are no groups
  BoxTree tree_;                  // boxes of the labeled cells
  std::vector<std::vector<Cell>> lowest_;  // [level][node] lowest input index in the node
  // [level][node] range of groups in the node; empty if there are no groups
  std::vector<std::vector<Range>> ranges_;
};

// The cells without a label, grouped by island.
std::vector<Place> unlabeled_places(std::span<const Label> labels, const Components& pieces) {
  std::vector<Place> places;
  for (Place place = 0; std::cmp_less(place, labels.size()); ++place) {
    if (labels[place] == kNoLabel) places.push_back(place);
  }
  std::ranges::stable_sort(places, [&](Place a, Place b) { return pieces.of[a] < pieces.of[b]; });
  return places;
}

// Finds the labeled cell nearest to each island. Islands are numbered like the connected
// components.
std::vector<Candidate> nearest_of(const OrderedGraph& graph, const LabeledCells& labeled,
                                  std::span<const Place> places, const Components& pieces,
                                  std::span<const Label> groups, ThreadTeam& team) {
  std::vector<Candidate> nearest(pieces.n_components);
  std::mutex mutex;
  auto search_range = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end;) {
      const Cell piece = pieces.of[places[i]];
      const Label group = groups.empty() ? kAnyGroup : groups[graph.cell_at(places[i])];
      Candidate best;  // best candidate for the cells of the island in this block
      for (; i < end && pieces.of[places[i]] == piece; ++i) {
        labeled.search(graph.positions[places[i]], places[i], group, best);
      }
      const std::scoped_lock lock(mutex);
      nearest[piece] = std::min(nearest[piece], best);
    }
  };
  team.for_each_block(std::ssize(places), search_range, kBlock);
  return nearest;
}

// Turns each island that may not join any region into a region.
void name_islands(const OrderedGraph& graph, const Components& pieces, JoinedIslands& joined) {
  Label next = *std::ranges::max_element(joined.labels) + 1;
  std::vector<Label> names(pieces.n_components, kNoLabel);
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    if (joined.labels[cell] != kNoLabel) continue;
    Label& name = names[pieces.of[graph.place_of(cell)]];
    if (name == kNoLabel) {
      name = next++;
      joined.new_centers.push_back(cell);
    }
    joined.labels[cell] = name;
  }
}

}  // namespace

JoinedIslands join_islands(const OrderedGraph& graph, std::span<const Label> labels,
                           std::span<const Label> groups, ThreadTeam& team) {
  JoinedIslands joined{copy_of(labels), 0, {}};
  if (std::ranges::find(labels, kNoLabel) == labels.end()) return joined;
  Buffer<Label> by_place(labels.size());
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) by_place[graph.place_of(cell)] = labels[cell];
  const Components pieces = find_components(graph, by_place.span(), team);
  const std::vector<Place> places = unlabeled_places(by_place.span(), pieces);
  const LabeledCells labeled(graph, by_place.span(), groups, team);
  const auto nearest = nearest_of(graph, labeled, places, pieces, groups, team);
  for (const Place place : places) {
    joined.labels[graph.cell_at(place)] = nearest[pieces.of[place]].label;
  }
  joined.n_joined = static_cast<Cell>(std::ranges::count_if(
      nearest, [](const Candidate& candidate) { return candidate.label != kNoLabel; }));
  name_islands(graph, pieces, joined);
  return joined;
}

}  // namespace superfacets
