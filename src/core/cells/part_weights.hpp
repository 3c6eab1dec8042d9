// Stage 2: the cost of arcs between the parts of a shape.
#pragma once

#include <cstddef>

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// The spectral embedding and exponents of groups of cells, or of cells.
struct PartFeatures {
  std::span<const Cell> group_of;  // (N,) the group of each cell; empty: each cell is a group
  std::size_t n_vectors;
  std::span<const float> vectors;     // (G, n_vectors) psi
  std::span<const double> exponents;  // (G,) x
  double factor;
};

// weights[a] = (given[a] + factor |psi_i - psi_j|) q_i q_j, q = exp(x), for the groups i and j at
// the ends of an arc. Symmetric in the two, bit for bit.
void part_weights(const Arcs& arcs, std::span<const double> given, const PartFeatures& features,
                  ThreadTeam& team, std::span<double> weights);

}  // namespace superfacets
