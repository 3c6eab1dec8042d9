// Farthest-point sampling with path lengths, used for seeding (stage 3).
#pragma once

#include <tuple>

#include "paths/expansion.hpp"

namespace superfacets {

// Computes the best path to every cell from the centers added so far, and finds the cell with the
// longest of these paths.
class LongestPaths {
 public:
  // Initially there are no centers.
  LongestPaths(const OrderedGraph& graph, ThreadTeam& team);

  // Adds one center, or several centers, which is faster than one after the other.
  void place(Place center);
  void place_all(std::span<const Place> centers);

  // Whether there is a path to a cell, and whether there are paths to all cells.
  bool reaches(Place place) const { return paths_.path(place).label != kNoLabel; }
  bool reach_all() const;

  // The reached cell with the longest path, or the lowest cell if several paths are equally long.
  // At least one reached cell must not be a center. After this call, only reached cells may be
  // added as centers.
  Place farthest();

  // The paths from the centers; the label of a path is the number of centers added before its own.
  PathArrays take_paths() && { return std::move(paths_).take_paths(); }

 private:
  struct Bound {
    PathLength longest;  // upper bound of the path lengths in the block
    Cell cell;           // the lowest cell with a path of this length
    std::int64_t block;  // index of the block

    bool operator<(const Bound& other) const {
      return std::tuple(longest, -cell) < std::tuple(other.longest, -other.cell);
    }
  };
  struct Farthest {
    PathLength length;
    Place place;
  };

  Farthest farthest_in(std::int64_t block) const;

  const OrderedGraph& graph_;
  Expansion paths_;
  Label n_placed_ = 0;
  std::vector<Bound> bounds_;  // bound of each block, as a max-heap
};

}  // namespace superfacets
