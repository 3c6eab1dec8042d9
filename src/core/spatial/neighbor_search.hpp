// Finds the nearest neighbors of all points of a cloud.
#pragma once

#include "base/buffer.hpp"
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

// Points along a space-filling curve, with a tree of boxes over these points. Points with the same
// Morton code, which are many in a cloud with a far outlier, are ordered by recursive halving of
// their box.
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

  // These functions move the arrays out of the search, which must not be used afterwards.
  Buffer<Cell> release_points() { return std::move(points_); }
  Buffer<Point> release_positions() { return std::move(positions_); }

  // Calls take(place, neighbors, thread) for each place, on any thread. `neighbors` holds the
  // n_nearest nearest other points, or all if there are fewer, in ascending order of distance.
  // Takes about a microsecond per point for eight neighbors.
  template <typename Take>
  void for_each_point(std::size_t n_nearest, const Take& take, ThreadTeam& team) const {
    for_each_wanted(n_nearest, [](Place) { return true; }, take, team);
  }

  // Like for_each_point, but only for places for which is_wanted(place) holds.
  template <typename IsWanted, typename Take>
  void for_each_wanted(std::size_t n_nearest, const IsWanted& is_wanted, const Take& take,
                       ThreadTeam& team) const {
    std::vector<Scratch> scratch(team.size());
    const auto n_leaves = static_cast<std::int64_t>(tree_.level(0).size());
    const auto search = [&](std::size_t leaf, int thread) {
      const auto [first, last] = tree_.places(leaf);
      bool is_searched = false;
      for (auto place = first; place < last; ++place) {
        if (!is_wanted(static_cast<Place>(place))) continue;
        if (!std::exchange(is_searched, true)) search_leaf(leaf, n_nearest, scratch[thread]);
        take(static_cast<Place>(place), scratch[thread].list_of(place - first, n_nearest), thread);
      }
    };
    team.for_each((n_leaves + kLeavesPerTask - 1) / kLeavesPerTask,
                  [&](std::int64_t task, int thread) {
                    const auto end = std::min(n_leaves, (task + 1) * kLeavesPerTask);
                    for (auto leaf = task * kLeavesPerTask; leaf < end; ++leaf) {
                      search(static_cast<std::size_t>(leaf), thread);
                    }
                  });
  }

 private:
  static constexpr std::int64_t kLeavesPerTask = 64;

  // Number of nearest leaves that are scanned first. Their points lower the bound, which excludes
  // most other leaves.
  static constexpr std::size_t kFirstLeaves = 12;

  // A leaf that may hold neighbors of the points of another leaf.
  struct Nearby {
    double apart;  // squared distance of the centers of their boxes, times four
    std::size_t leaf;
  };

  // Working memory of a thread.
  struct Scratch {
    std::vector<Neighbor> lists;     // n_nearest for each place of a leaf, nearest first
    std::vector<std::size_t> sizes;  // sizes of the lists
    std::vector<Nearby> nearby;
    std::span<const Neighbor> list_of(std::size_t row, std::size_t n_nearest) const {
      return {lists.data() + row * n_nearest, sizes[row]};
    }
  };

  void search_leaf(std::size_t leaf, std::size_t n_nearest, Scratch& scratch) const;
  void find_nearby(std::size_t leaf, double farthest, std::vector<Nearby>& nearby) const;
  void scan_leaves(std::size_t leaf, std::span<const Nearby> leaves, std::size_t n_nearest,
                   Scratch& scratch) const;
  void scan_leaf(std::size_t leaf, Place from, std::span<Neighbor> list, std::size_t& size) const;

  Buffer<Cell> points_;      // point at each place
  Buffer<Point> positions_;  // position at each place
  BoxTree tree_;
};

}  // namespace superfacets
