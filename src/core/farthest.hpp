// Farthest-point sampling in a tree of bounding boxes; used by the seeding stage.
#pragma once

#include "types.hpp"

namespace superfacets {

// The squared distance of every cell to the centers placed so far, and the farthest cell.
class FarthestPoints {
 public:
  // No center is placed yet. Sorts the cells along a space-filling curve and builds the tree.
  explicit FarthestPoints(std::span<const Point> positions);

  // Places a center at a cell: the cell is never the farthest again.
  void place(Cell center);

  // The farthest cell from all centers, the lowest index among equals. There must be one left.
  Cell farthest() const;

 private:
  // A group of consecutive leaves; node i of a level holds kFanOut nodes of the level below.
  struct Node {
    Point low, high;          // bounding box of its cells
    double farthest_squared;  // the largest squared distance among its cells
    Cell farthest;            // the cell that has it, lowest index among equals
  };

  void build_leaves(std::span<const Point> positions);
  void build_level();
  void update(std::size_t level, std::size_t index, Point center);
  void update_leaf(std::size_t leaf, Point center);
  void summarize_leaf(std::size_t leaf);
  void summarize(std::size_t level, std::size_t index);

  std::vector<Cell> cells_;                // (N,) in the order of the curve
  std::vector<Point> positions_;           // (N,) in the same order
  std::vector<double> squared_distance_;   // (N,) in the same order; infinite before any center
  std::vector<std::size_t> place_of_;      // (N,) where a cell stands in that order
  std::vector<std::vector<Node>> levels_;  // leaves first, the root alone in the last
};

}  // namespace superfacets
