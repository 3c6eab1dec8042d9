// Stage 2: prices of arcs by the distance between rows of numbers of their cells.
#pragma once

#include <cstddef>
#include <span>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Coordinates psi, in which the parts of a shape are far apart.
struct PartVectors {
  std::size_t width;
  std::span<const float> rows;  // (G, width)

  double distance(Cell one, Cell other) const;
};

// An arc length plus factor |psi_i - psi_j|, rounded to a whole number.
float with_price(float length, double factor, double distance);

// Adds factor |psi_i - psi_j| to the length of each arc, where i and j are the groups of its two
// cells, and rounds. group_of holds the group of each cell; if it is empty, each cell is a group.
// An arc and its reverse arc get the same bits.
Buffer<float> add_part_prices(const Arcs& arcs, std::span<const float> lengths,
                              std::span<const Cell> group_of, const PartVectors& vectors,
                              double factor, ThreadTeam& team);

// Returns given[a] + factor |f_i - f_j|, with the features of the cells at both ends of an
// arc, `n_features` numbers for each cell. Symmetric in the two, bit for bit.
Buffer<double> add_feature_steps(const Arcs& arcs, std::span<const double> given,
                                 std::span<const double> features, std::size_t n_features,
                                 double factor, ThreadTeam& team);

}  // namespace superfacets
