#include "spatial/neighbor_search.hpp"

#include <array>

#include "spatial/morton.hpp"

namespace superfacets {
namespace {

// A lower bound of the squared distance between points of two boxes. The bound also holds in
// floating point, see Box::squared_distance.
double squared_gap(const Box& a, const Box& b) {
  auto gap = [](double a_low, double a_high, double b_low, double b_high) {
    return std::max({b_low - a_high, 0.0, a_low - b_high});
  };
  return squared_norm({gap(a.low.x, a.high.x, b.low.x, b.high.x),
                       gap(a.low.y, a.high.y, b.low.y, b.high.y),
                       gap(a.low.z, a.high.z, b.low.z, b.high.z)});
}

// Inserts a neighbor into a sorted list of limited length. The list keeps only the nearest
// neighbors.
void insert(const Neighbor& neighbor, std::span<Neighbor> list, std::size_t& size) {
  if (size == list.size() && !(neighbor < list[size - 1])) return;
  if (size < list.size()) ++size;
  std::size_t slot = size - 1;
  for (; slot > 0 && neighbor < list[slot - 1]; --slot) list[slot] = list[slot - 1];
  list[slot] = neighbor;
}

// Upper bound of the squared distance of points that may enter the list.
double squared_reach(std::span<const Neighbor> list, std::size_t size) {
  return size < list.size() ? kInfinity : list[size - 1].squared;
}

}  // namespace

NeighborSearch::NeighborSearch(std::span<const Point> positions, std::span<const Cell> points,
                               ThreadTeam& team)
    : positions_(points.size()) {
  Buffer<Point> found(points.size());
  const auto n = static_cast<std::int64_t>(points.size());
  team.for_each_index(n, [&](std::int64_t i) { found[i] = positions[points[i]]; });
  points_ = refined_morton_order(found.span(), BoxTree::kLeaf, team);
  team.for_each_index(n, [&](std::int64_t place) {
    positions_[place] = found[points_[place]];
    points_[place] = points[points_[place]];
  });
  tree_ = BoxTree(positions_.span(), team);
}

// Finds the neighbors of all places of a leaf at once, with one traversal of the tree.
void NeighborSearch::search_leaf(std::size_t leaf, std::size_t n_nearest, Scratch& scratch) const {
  const auto [first, last] = tree_.places(leaf);
  scratch.lists.resize(BoxTree::kLeaf * n_nearest);
  scratch.sizes.assign(BoxTree::kLeaf, 0);
  const auto list_of = [&](std::size_t place) {
    return std::span(scratch.lists).subspan((place - first) * n_nearest, n_nearest);
  };
  // The points of the leaf itself give a first upper bound of the distances.
  double farthest = 0.0;
  for (auto place = first; place < last; ++place) {
    std::size_t& size = scratch.sizes[place - first];
    scan_leaf(leaf, static_cast<Place>(place), list_of(place), size);
    farthest = std::max(farthest, squared_reach(list_of(place), size));
  }
  find_nearby(leaf, farthest, scratch.nearby);
  // The nearest leaves lower the bound, so most of the other leaves are skipped.
  const auto n_first = std::min(kFirstLeaves, scratch.nearby.size());
  scan_leaves(leaf, std::span(scratch.nearby).first(n_first), n_nearest, scratch);
  farthest = 0.0;
  for (auto place = first; place < last; ++place) {
    farthest = std::max(farthest, squared_reach(list_of(place), scratch.sizes[place - first]));
  }
  const Box& box = tree_.level(0)[leaf];
  const auto rest = std::remove_if(
      scratch.nearby.begin() + static_cast<std::ptrdiff_t>(n_first), scratch.nearby.end(),
      [&](const Nearby& near) { return squared_gap(tree_.level(0)[near.leaf], box) > farthest; });
  scan_leaves(leaf, {scratch.nearby.begin() + static_cast<std::ptrdiff_t>(n_first), rest},
              n_nearest, scratch);
}

// Offers the points of other leaves as neighbors to the points of a leaf.
void NeighborSearch::scan_leaves(std::size_t leaf, std::span<const Nearby> leaves,
                                 std::size_t n_nearest, Scratch& scratch) const {
  const auto [first, last] = tree_.places(leaf);
  for (auto place = first; place < last; ++place) {
    const auto list = std::span(scratch.lists).subspan((place - first) * n_nearest, n_nearest);
    std::size_t& size = scratch.sizes[place - first];
    for (const Nearby& near : leaves) {
      const double gap = tree_.level(0)[near.leaf].squared_distance(positions_[place]);
      if (gap > squared_reach(list, size)) continue;
      scan_leaf(near.leaf, static_cast<Place>(place), list, size);
    }
  }
}

// Lists the other leaves at a squared distance of at most `farthest` from a leaf, sorted by the
// distance of centers. Scanning the nearest leaves first lowers the bound, which excludes most
// other leaves.
void NeighborSearch::find_nearby(std::size_t leaf, double farthest,
                                 std::vector<Nearby>& nearby) const {
  const Box& box = tree_.level(0)[leaf];
  const Point middle = box.low + box.high;
  nearby.clear();
  const auto may_hold = [&](std::size_t level, std::size_t index) {
    return squared_gap(tree_.level(level)[index], box) <= farthest;
  };
  tree_.visit_leaves(may_hold, [&](std::size_t begin, std::size_t) {
    const std::size_t near = begin / BoxTree::kLeaf;
    const Box& other = tree_.level(0)[near];
    const double apart = squared_norm(other.low + other.high - middle);
    if (near != leaf) nearby.push_back({apart, near});
  });
  std::ranges::sort(nearby, [](const Nearby& a, const Nearby& b) { return a.apart < b.apart; });
}

// Offers the points of a leaf, except the point at `from`, to the list of a place.
void NeighborSearch::scan_leaf(std::size_t leaf, Place from, std::span<Neighbor> list,
                               std::size_t& size) const {
  const Point center = positions_[from];
  const auto [first, last] = tree_.places(leaf);
  std::array<double, BoxTree::kLeaf> squared;  // in a separate loop without branches
  for (auto place = first; place < last; ++place) {
    squared[place - first] = squared_norm(positions_[place] - center);
  }
  for (auto place = first; place < last; ++place) {
    if (squared[place - first] > squared_reach(list, size)) continue;
    if (std::cmp_equal(place, from)) continue;
    insert({squared[place - first], points_[place], static_cast<Place>(place)}, list, size);
  }
}

}  // namespace superfacets
