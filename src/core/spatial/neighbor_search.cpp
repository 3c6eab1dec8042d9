#include "spatial/neighbor_search.hpp"

#include "spatial/morton.hpp"

namespace superfacets {
namespace {

// Maximum number of leaves in the list of nearby leaves. If more leaves are nearby, each search
// starts at the root.
constexpr std::size_t kMaxLeaves = 256;

// Up to this number of candidates, ranking each candidate by counting the nearer ones is faster
// than sorting.
constexpr std::size_t kMaxRanked = 64;

// Searches start at the root if there are more candidates than kFewCandidates, and more than eight
// times the number of neighbors.
constexpr std::size_t kFewCandidates = 256;

constexpr std::size_t kNoBlock = std::numeric_limits<std::size_t>::max();

// Factor that enlarges squared bounds by more than all rounding errors.
constexpr double kSlack = 1.0 + 1e-9;

// Inserts a neighbor into a sorted list of limited length. The list keeps only the nearest
// neighbors.
void insert(const Neighbor& neighbor, std::span<Neighbor> list, std::size_t& size) {
  if (size == list.size() && !(neighbor < list[size - 1])) return;
  if (size < list.size()) ++size;
  std::size_t slot = size - 1;
  for (; slot > 0 && neighbor < list[slot - 1]; --slot) list[slot] = list[slot - 1];
  list[slot] = neighbor;
}

// Maximum squared distance of points that can still be inserted into the list.
double squared_reach(std::span<const Neighbor> list, std::size_t size) {
  return size < list.size() ? kInfinity : list[size - 1].squared;
}

// The distance from a point in a box to the farthest corner of the box.
double farthest_corner(const Box& box, const Point& p) {
  const Point low = p - box.low;
  const Point high = box.high - p;
  return norm({std::max(low.x, high.x), std::max(low.y, high.y), std::max(low.z, high.z)});
}

// The square of a distance, enlarged by more than all rounding errors.
double squared_above(double distance) {
  return distance * distance * kSlack;
}

// Appends the points of a block whose squared distance from the center is at most squared_bound to
// the candidates.
struct CollectLoop {
  template <typename Block>
  SUPERFACETS_ALWAYS_INLINE void operator()(const Block& block, Place first, std::size_t n_points,
                                            const Point& center, double squared_bound,
                                            double* squared, Place* places,
                                            std::size_t* n_found) const {
    std::array<double, BoxTree::kLeaf> apart;
    for (std::size_t i = 0; i < BoxTree::kLeaf; ++i) apart[i] = squared_norm(block.get(i) - center);
    std::size_t n = *n_found;
    for (std::size_t i = 0; i < n_points; ++i) {
      squared[n] = apart[i];
      places[n] = static_cast<Place>(first + i);
      n += apart[i] <= squared_bound ? 1 : 0;
    }
    *n_found = n;
  }
};

// Computes for each number how many of the numbers are lower.
struct RankLoop {
  SUPERFACETS_ALWAYS_INLINE void operator()(const double* numbers, std::size_t n,
                                            std::int64_t* ranks) const {
    for (std::size_t i = 0; i < n; ++i) {
      std::int64_t rank = 0;
      for (std::size_t j = 0; j < n; ++j) rank += numbers[j] < numbers[i] ? 1 : 0;
      ranks[i] = rank;
    }
  }
};

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
  const auto codes = morton_codes(positions_.span(), bounds_of(positions_.span(), team), team);
  tree_ = BoxTree(positions_.span(), octant_ranges(codes.span(), BoxTree::kLeaf), team);
}

NearestFinder::NearestFinder(const NeighborSearch& search, std::size_t n_nearest)
    : search_(search),
      n_nearest_(n_nearest),
      n_most_(std::max(kFewCandidates, 8 * n_nearest)),
      leaf_(search.tree().level(0).size()),
      squared_(n_most_ + BoxTree::kLeaf),
      places_(n_most_ + BoxTree::kLeaf) {
  reaches_.fill(kInfinity);
}

std::span<const Neighbor> NearestFinder::nearest_of(Place place, std::size_t leaf) {
  const Point& center = search_.position_at(place);
  double bound = bound_by_recent(center);
  if (leaf != leaf_) {
    bound = std::min(bound, bound_along_curve(place));
    enter(leaf, center, bound);
  }
  const double squared_bound = squared_above(bound);
  if (!collect(place, squared_bound)) {
    search_tree(place, squared_bound);
  } else if (n_candidates_ <= kMaxRanked) {
    rank_candidates();
  } else {
    sort_candidates();
  }
  const std::size_t slot = n_searches_++ % kRecent;
  recent_.set(slot, center);
  reaches_[slot] = list_.size() < n_nearest_ ? kInfinity : std::sqrt(list_.back().squared);
  return list_;
}

// Upper bound of the distance to the farthest neighbor, computed from recent searches. By the
// triangle inequality, all neighbors of a recent point are within (distance to the recent point) +
// (distance between the recent point and its farthest neighbor).
double NearestFinder::bound_by_recent(const Point& center) const {
  double bound = kInfinity;
  for (std::size_t i = 0; i < kRecent; ++i) {
    bound = std::min(bound, reaches_[i] + norm(recent_.get(i) - center));
  }
  return bound;
}

// Upper bound of the distance to the farthest neighbor, computed from points that are adjacent
// along the curve.
double NearestFinder::bound_along_curve(Place place) {
  const auto n_along = static_cast<Place>(std::max(n_nearest_, BoxTree::kLeaf - 1));
  if (search_.n_points() <= n_along) return kInfinity;
  const Place first = std::clamp(place - n_along / 2, 0, search_.n_points() - n_along - 1);
  squared_.clear();
  for (Place near = first; near <= first + n_along; ++near) {
    squared_.push_back(squared_norm(search_.position_at(near) - search_.position_at(place)));
  }
  std::ranges::nth_element(squared_, squared_.begin() + static_cast<std::ptrdiff_t>(n_nearest_));
  const double squared = squared_[n_nearest_];  // the first entry is the point itself
  squared_.resize(places_.size());
  return std::sqrt(squared);
}

// Lists the leaves that may contain neighbors of the points of a leaf. `bound` is an upper bound of
// the neighbors' distances for `center`, a point of the leaf.
void NearestFinder::enter(std::size_t leaf, const Point& center, double bound) {
  leaf_ = leaf;
  n_blocks_ = 0;
  nearby_.clear();
  const BoxTree& tree = search_.tree();
  const Box& box = tree.level(0)[leaf];
  const double limit = squared_above(bound + farthest_corner(box, center));
  const auto may_hold = [&](std::size_t level, std::size_t index) {
    return nearby_.size() <= kMaxLeaves && box.squared_distance(tree.level(level)[index]) <= limit;
  };
  tree.visit_leaves(may_hold, [&](std::size_t near) {
    const Box& other = tree.level(0)[near];
    nearby_.push_back({box.squared_distance(other), near, kNoBlock, other});
  });
  if (nearby_.size() > kMaxLeaves) return nearby_.clear();
  std::ranges::sort(nearby_, {}, &Nearby::gap);
}

// Collects the other points within a distance of a point. Returns false if there are too many
// points, or if the list of leaves is empty.
bool NearestFinder::collect(Place place, double squared_bound) {
  const Point& center = search_.position_at(place);
  n_candidates_ = 0;
  for (Nearby& near : nearby_) {
    if (near.gap > squared_bound) break;
    if (near.box.squared_distance(center) > squared_bound) continue;
    const auto [first, last] = search_.tree().places(near.leaf);
    run_version(instructions_, CollectLoop{}, block_of(near), static_cast<Place>(first),
                last - first, center, squared_bound, squared_.data(), places_.data(),
                &n_candidates_);
    if (n_candidates_ > n_most_) return false;
  }
  const auto found = std::span(places_).first(n_candidates_);
  const auto own = static_cast<std::size_t>(std::ranges::find(found, place) - found.begin());
  if (own == n_candidates_) return false;  // true only if the list of leaves is empty
  --n_candidates_;
  places_[own] = places_[n_candidates_];
  squared_[own] = squared_[n_candidates_];
  return true;
}

// The positions of a leaf, which are copied at the first call.
const NearestFinder::Block& NearestFinder::block_of(Nearby& near) {
  if (near.block == kNoBlock) {
    near.block = n_blocks_++;
    if (blocks_.size() < n_blocks_) blocks_.emplace_back();
    const auto [first, last] = search_.tree().places(near.leaf);
    for (auto place = first; place < last; ++place) {
      blocks_[near.block].set(place - first, search_.position_at(static_cast<Place>(place)));
    }
  }
  return blocks_[near.block];
}

// Sorts the candidates by counting: the position of a candidate in the list is the number of nearer
// candidates.
void NearestFinder::rank_candidates() {
  std::array<std::int64_t, kMaxRanked> ranks;
  run_version(instructions_, RankLoop{}, squared_.data(), n_candidates_, ranks.data());
  list_.assign(std::min(n_nearest_, n_candidates_), Neighbor{-1.0, kNoPlace});
  for (std::size_t i = 0; i < n_candidates_; ++i) {
    if (std::cmp_greater_equal(ranks[i], list_.size())) continue;
    Neighbor neighbor{squared_[i], places_[i]};
    // Equally near points have the same rank. These points fill the list from this rank onwards, in
    // sorted order.
    for (auto slot = static_cast<std::size_t>(ranks[i]); slot < list_.size(); ++slot) {
      const bool is_free = list_[slot].place == kNoPlace;
      if (is_free || neighbor < list_[slot]) std::swap(neighbor, list_[slot]);
      if (is_free) break;
    }
  }
}

void NearestFinder::sort_candidates() {
  list_.clear();
  for (std::size_t i = 0; i < n_candidates_; ++i) {
    list_.push_back({squared_[i], places_[i]});
  }
  const auto n = static_cast<std::ptrdiff_t>(std::min(n_nearest_, n_candidates_));
  std::partial_sort(list_.begin(), list_.begin() + n, list_.end());
  list_.resize(n);
}

// Searches the whole tree, from the nearest to the farthest box.
void NearestFinder::search_tree(Place place, double squared_bound) {
  const Point& center = search_.position_at(place);
  const BoxTree& tree = search_.tree();
  list_.resize(n_nearest_);
  std::size_t size = 0;
  const auto squared_distance = [&](std::size_t level, std::size_t index) {
    return tree.level(level)[index].squared_distance(center);
  };
  tree.visit_nearest(squared_distance, squared_bound, [&](std::size_t begin, std::size_t end) {
    for (auto at = static_cast<Place>(begin); std::cmp_less(at, end); ++at) {
      if (at == place) continue;
      insert({squared_norm(search_.position_at(at) - center), at}, list_, size);
    }
    squared_bound = std::min(squared_bound, squared_reach(list_, size));
  });
  list_.resize(size);
}

}  // namespace superfacets
