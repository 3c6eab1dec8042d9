// Farthest-point sampling in a tree of bounding boxes; used by the seeding stage.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Stores the squared distance of every cell to the nearest center placed so far, and finds the
// farthest cell.
class FarthestPoints {
 public:
  // Starts without centers.
  FarthestPoints(const OrderedGraph& graph, ThreadTeam& team);

  // Excludes the places for which is_left_out(place) holds: they are never the farthest.
  template <typename IsLeftOut>
  void leave_out(const IsLeftOut& is_left_out) {
    for (Place place = 0; place < graph_.n_cells(); ++place) {
      if (is_left_out(place)) squared_distance_[place] = kIsCenter;
    }
    summarize_all();
  }

  // Places a center: its cell is never the farthest again.
  void place(Place center);

  // The cell farthest from all centers. Ties go to the lowest cell. At least one cell must be
  // neither a center nor excluded.
  Place farthest() const;

 private:
  // Squared distance stored for centers and excluded places. It is less than every real one, so
  // these places are never the farthest.
  static constexpr double kIsCenter = -1.0;

  struct Summary {
    double farthest_squared;  // the largest squared distance among the cells of a node
    Place farthest;           // the place at that distance; ties go to the lowest cell
  };

  bool can_change(std::size_t level, std::size_t index, Point center) const;
  void find_changing(std::size_t level, std::size_t index, Point center,
                     std::vector<std::size_t>& changing) const;
  void update_all(std::size_t top, Point center);
  void update(std::size_t level, std::size_t index, Point center);
  void update_leaf(std::size_t leaf, Point center);
  void summarize_all();
  void summarize_leaf(std::size_t leaf);
  void summarize(std::size_t level, std::size_t index);
  bool is_farther(const Summary& a, const Summary& b) const;

  const OrderedGraph& graph_;
  ThreadTeam& team_;
  Buffer<double> squared_distance_;              // (N,) infinite before any center
  std::vector<std::vector<Summary>> summaries_;  // of each node, indexed as in the tree
};

}  // namespace superfacets
