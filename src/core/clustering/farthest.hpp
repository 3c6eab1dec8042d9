// Farthest-point sampling with a tree of bounding boxes, used for seeding (stage 3).
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Stores the squared distance of every cell to the nearest center so far, and finds the farthest
// cell.
class FarthestPoints {
 public:
  // Initially, there are no centers.
  FarthestPoints(const OrderedGraph& graph, ThreadTeam& team);

  // Excludes the cells for which is_left_out(place) is true, so that they are never the farthest.
  template <typename IsLeftOut>
  void leave_out(const IsLeftOut& is_left_out) {
    for (Place place = 0; place < graph_.n_cells(); ++place) {
      if (is_left_out(place)) squared_distance_[place] = kIsCenter;
    }
    summarize_all();
  }

  // Adds a center and updates the distances of all cells.
  void place(Place center);

  // The cell farthest from all centers, or the lowest cell if several are equally far. At least one
  // cell must be neither a center nor excluded.
  Place farthest() const;

 private:
  // Squared distance stored for centers and excluded cells. This value is less than every actual
  // squared distance, so these cells are never the farthest.
  static constexpr double kIsCenter = -1.0;

  struct Summary {
    double farthest_squared;  // maximum squared distance of the cells of a node
    Place farthest;           // the cell at this distance; the lowest if there are several
  };

  bool can_change(std::size_t level, std::size_t index, Point center) const;
  void find_changing(std::size_t level, std::size_t index, Point center,
                     std::vector<std::size_t>& changing) const;
  void update_all(std::size_t top, Point center);
  void update(std::size_t level, std::size_t index, Point center);
  void update_leaf(std::size_t leaf, Point center);
  void summarize_all();
  void summarize(std::size_t level, std::size_t index);
  bool is_farther(const Summary& a, const Summary& b) const;

  const OrderedGraph& graph_;
  ThreadTeam& team_;
  Buffer<double> squared_distance_;              // (N,) squared distance to the nearest center
  std::vector<std::vector<Summary>> summaries_;  // [level][node] maximum of each tree node
};

}  // namespace superfacets
