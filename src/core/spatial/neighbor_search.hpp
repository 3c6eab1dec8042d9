// Finds the nearest neighbors of all points of a point cloud.
#pragma once

#include "base/buffer.hpp"
#include "base/point_block.hpp"
#include "spatial/box_tree.hpp"

namespace superfacets {

// A neighbor of a point.
struct Neighbor {
  double squared;  // squared distance from the point
  Place place;     // sorted index of the neighbor

  auto operator<=>(const Neighbor&) const = default;  // by distance, then by sorted index
};

// Points sorted along a space-filling curve, with a box tree. If a cloud has a far outlier, many
// points have the same Morton code. These points are ordered by recursive splits at the median (see
// refined_morton_order).
class NeighborSearch {
 public:
  // Builds a search for a subset of a cloud. `points` contains the indices of the subset,
  // ascending. No two points of the subset may have the same position.
  NeighborSearch(std::span<const Point> positions, std::span<const Cell> points, ThreadTeam& team);

  Place n_points() const { return static_cast<Place>(points_.size()); }
  Cell point_at(Place place) const { return points_[place]; }
  const Point& position_at(Place place) const { return positions_[place]; }
  std::span<const Point> positions() const { return positions_.span(); }  // in sorted order
  const BoxTree& tree() const { return tree_; }

  // These two functions move the arrays out of the search. The search must not be used afterwards.
  Buffer<Cell> release_points() { return std::move(points_); }
  Buffer<Point> release_positions() { return std::move(positions_); }

  // Calls take(place, neighbors) for each point, on any thread. `neighbors` contains the n_nearest
  // nearest other points (or all other points, if there are fewer), in ascending order of distance.
  // Takes about half a microsecond per point for twelve neighbors.
  template <typename Take>
  void for_each_point(std::size_t n_nearest, const Take& take, ThreadTeam& team) const;

 private:
  static constexpr std::int64_t kLeavesPerTask = 64;

  Buffer<Cell> points_;      // input index of each sorted point
  Buffer<Point> positions_;  // position of each sorted point
  BoxTree tree_;
};

// The searches of one thread, from point to point along the curve. The neighbors of previous points
// give an upper bound of the distances, so a search reads only a few leaves. Results do not depend
// on the previous searches.
class NearestFinder {
 public:
  NearestFinder(const NeighborSearch& search, std::size_t n_nearest);

  // The neighbors of a point that is in a given leaf, in ascending order of distance. The result is
  // valid until the next call.
  std::span<const Neighbor> nearest_of(Place place, std::size_t leaf);

 private:
  // A leaf that may contain neighbors of the points of the current leaf.
  struct Nearby {
    double gap;         // squared distance between the boxes of this leaf and of the current leaf
    std::size_t leaf;   // index of the leaf
    std::size_t block;  // index of the positions of the leaf in blocks_, or kNoBlock
    Box box;            // bounding box of the leaf
  };
  using Block = PointBlock<BoxTree::kLeaf>;

  double bound_by_recent(const Point& center) const;
  double bound_along_curve(Place place);
  void enter(std::size_t leaf, const Point& center, double bound);
  bool collect(Place place, double squared_bound);
  const Block& block_of(Nearby& near);
  void rank_candidates();
  void sort_candidates();
  void search_tree(Place place, double squared_bound);

  const NeighborSearch& search_;
  const std::size_t n_nearest_;
  const std::size_t n_most_;  // maximum number of candidates
  const InstructionSet instructions_ = best_instruction_set();

  std::size_t leaf_;            // the current leaf
  std::vector<Nearby> nearby_;  // nearby leaves by ascending distance; empty if there are too many
  std::vector<Block> blocks_;
  std::size_t n_blocks_ = 0;

  static constexpr std::size_t kRecent = 8;
  // Points of the last kRecent searches, and the distance from each of them to the farthest
  // neighbor that was found.
  PointBlock<kRecent> recent_{};
  std::array<double, kRecent> reaches_;
  std::size_t n_searches_ = 0;

  std::vector<double> squared_;  // squared distances of the candidates
  std::vector<Place> places_;    // sorted indices of the candidates
  std::size_t n_candidates_ = 0;
  std::vector<Neighbor> list_;
};

template <typename Take>
void NeighborSearch::for_each_point(std::size_t n_nearest, const Take& take,
                                    ThreadTeam& team) const {
  const auto search_leaves = [&](std::int64_t begin, std::int64_t end) {
    NearestFinder finder(*this, n_nearest);
    for (std::int64_t leaf = begin; leaf < end; ++leaf) {
      const auto [first, last] = tree_.places(leaf);
      for (auto place = static_cast<Place>(first); std::cmp_less(place, last); ++place) {
        take(place, finder.nearest_of(place, leaf));
      }
    }
  };
  team.for_each_block(std::ssize(tree_.level(0)), search_leaves, kLeavesPerTask);
}

}  // namespace superfacets
