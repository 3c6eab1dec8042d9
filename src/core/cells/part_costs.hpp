// Stage 2: adds to each arc a cost proportional to the distance between the feature vectors of its
// two cells.
#pragma once

#include "base/buffer.hpp"
#include "base/elementary.hpp"
#include "base/threads.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Euclidean distance between two rows. The row width is kWidth or, if kWidth is 0, any_width. A
// width that is known at compile time makes the function twice as fast.
template <std::size_t kWidth, typename Number>
double distance_in(std::span<const Number> rows, std::size_t any_width, Cell one, Cell other) {
  const std::size_t width = kWidth > 0 ? kWidth : any_width;
  const Number* here = rows.data() + width * one;
  const Number* there = rows.data() + width * other;
  double squared = 0.0;
  for (std::size_t i = 0; i < width; ++i) {
    const double difference = double{here[i]} - double{there[i]};
    squared += difference * difference;
  }
  return std::sqrt(squared);
}

template <typename Number>
double distance_between(std::span<const Number> rows, std::size_t width, Cell one, Cell other) {
  return width == 8 ? distance_in<8>(rows, width, one, other)
                    : distance_in<0>(rows, width, one, other);
}

// A feature vector psi for each group of cells. The vectors of different parts of a shape are far
// apart.
struct PartVectors {
  std::size_t width;             // number of features
  std::span<const float> rows;   // (G, width) one vector per group
  std::span<const Cell> groups;  // (N,) group of each cell; empty if each cell is its own group

  Cell group_of(Cell cell) const { return groups.empty() ? cell : groups[cell]; }

  // The distance between the rows of two groups.
  double distance(Cell one, Cell other) const { return distance_between(rows, width, one, other); }
};

// A cost for each arc between two groups of cells.
struct GroupCosts {
  Arcs arcs;                     // arcs between groups
  std::span<const float> costs;  // cost of each arc
  std::span<const Cell> groups;  // (N,) group of each cell; empty if each cell is its own group

  Cell group_of(Cell cell) const { return groups.empty() ? cell : groups[cell]; }

  // The cost of the first arc from one group to another, or 0 if there is none.
  double between(Cell one, Cell other) const {
    const auto neighbors = arcs.neighbors(one);
    const auto found = std::ranges::find(neighbors, other) - neighbors.begin();
    return found < std::ssize(neighbors) ? double{costs[arcs.offsets[one] + found]} : 0.0;
  }
};

// An arc length plus a cost, rounded to a whole number.
inline float with_cost(float length, double factor, double cost) {
  return static_cast<float>(round_to_whole(double{length} + factor * cost));
}

// Adds factor |psi_i - psi_j| to the length of each arc, where i and j are the groups of the arc's
// two cells. The result is rounded to a whole number. If an arc and its reverse arc have the same
// length, their results are equal, too.
Buffer<float> add_part_costs(const Arcs& arcs, std::span<const float> lengths,
                             const PartVectors& vectors, double factor, ThreadTeam& team);

// Adds the costs between groups to the length of each arc, in the same way, but in place.
void add_group_costs(const Arcs& arcs, std::span<float> lengths, const GroupCosts& costs,
                     ThreadTeam& team);

// Returns given[a] + factor |f_i - f_j| for each arc a, where f_i and f_j are the features of the
// arc's two cells. `features` has n_features numbers per cell. If the given values of an arc and
// its reverse arc are bit-identical, the results are, too.
Buffer<double> add_feature_steps(const Arcs& arcs, std::span<const double> given,
                                 std::span<const double> features, std::size_t n_features,
                                 double factor, ThreadTeam& team);

}  // namespace superfacets
