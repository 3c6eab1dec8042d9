// Stage 2: prices of arcs that are proportional to the distance between feature rows of their
// cells.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Coordinates psi of cells or groups, in which different parts of a shape are far apart.
struct PartVectors {
  std::size_t width;
  std::span<const float> rows;  // (G, width)

  double distance(Cell one, Cell other) const;
};

// An arc length plus factor |psi_i - psi_j|, rounded to a whole number.
float with_price(float length, double factor, double distance);

// Adds factor |psi_i - psi_j| to the length of each arc, and rounds the result; i and j are the
// groups of the arc's two cells. group_of holds the group of each cell; if it is empty, each cell
// is a group. An arc and its reverse arc get the same bits.
Buffer<float> add_part_prices(const Arcs& arcs, std::span<const float> lengths,
                              std::span<const Cell> group_of, const PartVectors& vectors,
                              double factor, ThreadTeam& team);

// Returns given[a] + factor |f_i - f_j| for each arc a; f_i and f_j are the features of its two
// cells. `features` has n_features numbers per cell. An arc and its reverse arc get the same bits
// if `given` has.
Buffer<double> add_feature_steps(const Arcs& arcs, std::span<const double> given,
                                 std::span<const double> features, std::size_t n_features,
                                 double factor, ThreadTeam& team);

}  // namespace superfacets
