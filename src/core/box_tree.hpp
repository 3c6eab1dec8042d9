// Boxes around groups of cells, groups of groups, and so on up to all.
#pragma once

#include <vector>

#include "box.hpp"
#include "ordered_graph.hpp"

namespace superfacets {

// A leaf holds kLeaf consecutive places on the curve, a node kFanOut nodes of the level below.
class BoxTree {
 public:
  static constexpr std::size_t kLeaf = 32;   // positions of a leaf fill twelve cache lines
  static constexpr std::size_t kFanOut = 8;  // an octant's share of a Morton curve

  BoxTree(const OrderedGraph& graph, ThreadTeam& team);

  // Levels, the leaves first and the root alone in the last.
  std::size_t n_levels() const { return levels_.size(); }
  std::span<const Box> level(std::size_t level) const { return levels_[level]; }

  // Of a node above the leaves: its nodes in the level below, first to one past the last.
  std::pair<std::size_t, std::size_t> children(std::size_t level, std::size_t index) const {
    return {index * kFanOut, std::min((index + 1) * kFanOut, levels_[level - 1].size())};
  }
  // Of a leaf: its places, likewise.
  std::pair<std::size_t, std::size_t> places(std::size_t leaf) const {
    return {leaf * kLeaf, std::min((leaf + 1) * kLeaf, n_cells_)};
  }

  // The nearest place to a point, the lowest cell among equals, of those that `is_wanted`. One
  // that is wanted has to be given; the nearer it is, the less is looked at.
  template <typename IsWanted>
  Place nearest(const OrderedGraph& graph, Point target, Place wanted,
                const IsWanted& is_wanted) const {
    Nearest nearest{wanted, squared_norm(graph.positions[wanted] - target)};
    search(graph, target, is_wanted, n_levels() - 1, 0, nearest);
    return nearest.place;
  }

 private:
  struct Nearest {
    Place place;
    double squared_distance;
  };

  template <typename IsWanted>
  void search(const OrderedGraph& graph, Point target, const IsWanted& is_wanted, std::size_t level,
              std::size_t index, Nearest& nearest) const {
    // A box just as far away may still hold a lower cell.
    if (levels_[level][index].squared_distance(target) > nearest.squared_distance) return;
    if (level > 0) {
      const auto [begin, end] = children(level, index);
      for (auto child = begin; child < end; ++child) {
        search(graph, target, is_wanted, level - 1, child, nearest);
      }
      return;
    }
    const auto [begin, end] = places(index);
    for (auto place = begin; place < end; ++place) {
      const double squared = squared_norm(graph.positions[place] - target);
      if (squared > nearest.squared_distance || !is_wanted(static_cast<Place>(place))) continue;
      if (squared == nearest.squared_distance && graph.cells[place] >= graph.cells[nearest.place]) {
        continue;
      }
      nearest = {static_cast<Place>(place), squared};
    }
  }

  std::size_t n_cells_;
  std::vector<std::vector<Box>> levels_;
};

}  // namespace superfacets
