// Farthest-point sampling by path length; used by the seeding stage.
#pragma once

#include <span>
#include <tuple>

#include "cells/ordered_graph.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Computes the best path to every place from the centers placed so far, and finds the place with
// the longest of these paths.
class LongestPaths {
 public:
  // Initially there are no centers.
  LongestPaths(const OrderedGraph& graph, ThreadTeam& team);

  void place(Place center);
  void place_all(std::span<const Place> centers);  // faster than one after the other

  // reaches: whether a path reaches a place. reach_all: whether paths reach all places.
  bool reaches(Place place) const { return paths_.path(place).label != kNoLabel; }
  bool reach_all() const;

  // The reached place with the longest path. Ties go to the lowest cell. At least one reached place
  // must not be a center. Centers placed after this call must be reached places, too.
  Place farthest();

 private:
  struct Bound {
    PathLength longest;  // no path in the block is longer
    Cell cell;           // the lowest cell with a path of this length
    std::int64_t block;

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
  std::vector<Bound> bounds_;  // one per block of places; a heap, the highest first
};

}  // namespace superfacets
