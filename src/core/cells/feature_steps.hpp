// Stage 2: the cost of arcs between cells with different features.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// weights[a] = given[a] + factor |f_i - f_j|, with the features of the cells at both ends of an
// arc, `n_features` numbers for each cell. Symmetric in the two, bit for bit.
void add_feature_steps(const Arcs& arcs, std::span<const double> given,
                       std::span<const double> features, std::size_t n_features, double factor,
                       ThreadTeam& team, std::span<double> weights);

}  // namespace superfacets
