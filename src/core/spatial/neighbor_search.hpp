// The nearest neighbors of all points of a cloud.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "base/box.hpp"
#include "base/buffer.hpp"
#include "base/point_block.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "base/versions.hpp"
#include "spatial/box_tree.hpp"

namespace superfacets {

// A point, and its distance from another point.
struct Neighbor {
  double squared;  // squared distance
  Cell point;
  Place place;
};

// Orders by distance, and by index among equal distances.
inline bool operator<(const Neighbor& a, const Neighbor& b) {
  return a.squared < b.squared || (a.squared == b.squared && a.point < b.point);
}

// Points along a space-filling curve, with a tree of boxes over them. If many points have the same
// Morton code, as in a cloud with a far outlier, they are ordered by recursive halving of their
// box.
class NeighborSearch {
 public:
  // Builds a search of a subset of a cloud. `points` holds the indices of the subset, ascending. No
  // two of these points share a position.
  NeighborSearch(std::span<const Point> positions, std::span<const Cell> points, ThreadTeam& team);

  Place n_points() const { return static_cast<Place>(points_.size()); }
  Cell point_at(Place place) const { return points_[place]; }
  const Point& position_at(Place place) const { return positions_[place]; }
  std::span<const Cell> points() const { return points_.span(); }         // by place
  std::span<const Point> positions() const { return positions_.span(); }  // by place
  const BoxTree& tree() const { return tree_; }

  // Move the arrays out of the search, which must not be used afterwards.
  Buffer<Cell> release_points() { return std::move(points_); }
  Buffer<Point> release_positions() { return std::move(positions_); }

  // Calls take(place, neighbors, thread) for each place, on any thread. The neighbors are the
  // n_nearest nearest other points, nearest first, or all if there are fewer. About half a
  // microsecond per point for twelve neighbors.
  template <typename Take>
  void for_each_point(std::size_t n_nearest, const Take& take, ThreadTeam& team) const {
    for_each_wanted(n_nearest, [](Place) { return true; }, take, team);
  }

  // Like for_each_point, but only for places for which is_wanted(place) holds.
  template <typename IsWanted, typename Take>
  void for_each_wanted(std::size_t n_nearest, const IsWanted& is_wanted, const Take& take,
                       ThreadTeam& team) const;

 private:
  static constexpr std::int64_t kLeavesPerTask = 64;

  Buffer<Cell> points_;      // point at each place
  Buffer<Point> positions_;  // position at each place
  BoxTree tree_;
};

// The searches of one thread, from place to place along the curve. The neighbors of the previous
// places give an upper bound of the distances, so few leaves are read. Results do not depend on the
// previous searches.
class NearestFinder {
 public:
  NearestFinder(const NeighborSearch& search, std::size_t n_nearest);

  // The neighbors of a place in a leaf, nearest first. Valid until the next call.
  std::span<const Neighbor> nearest_of(Place place, std::size_t leaf);

 private:
  // A leaf that may hold neighbors of the points of the current leaf.
  struct Nearby {
    double gap;  // squared distance of the boxes
    std::size_t leaf;
    std::size_t block;  // index of the copy of its positions
    Box box;
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
  std::vector<Nearby> nearby_;  // nearest first; empty if there are too many
  std::vector<Block> blocks_;
  std::size_t n_blocks_ = 0;

  // Positions of the last searches, and the distances of their last neighbors.
  static constexpr std::size_t kRecent = 8;
  PointBlock<kRecent> recent_{};
  std::array<double, kRecent> reaches_;
  std::size_t n_searches_ = 0;

  std::vector<double> squared_;  // squared distances of the candidates
  std::vector<Place> places_;    // places of the candidates
  std::size_t n_candidates_ = 0;
  std::vector<Neighbor> list_;
};

template <typename IsWanted, typename Take>
void NeighborSearch::for_each_wanted(std::size_t n_nearest, const IsWanted& is_wanted,
                                     const Take& take, ThreadTeam& team) const {
  const auto n_leaves = std::ssize(tree_.level(0));
  team.for_each((n_leaves + kLeavesPerTask - 1) / kLeavesPerTask,
                [&](std::int64_t task, int thread) {
                  NearestFinder finder(*this, n_nearest);
                  const auto end = std::min(n_leaves, (task + 1) * kLeavesPerTask);
                  for (auto leaf = task * kLeavesPerTask; leaf < end; ++leaf) {
                    const auto [first, last] = tree_.places(leaf);
                    for (auto at = first; at < last; ++at) {
                      const auto place = static_cast<Place>(at);
                      if (is_wanted(place)) take(place, finder.nearest_of(place, leaf), thread);
                    }
                  }
                });
}

}  // namespace superfacets
