#include "cells/feature_steps.hpp"

#include "base/assert.hpp"

namespace superfacets {

void add_feature_steps(const Arcs& arcs, std::span<const double> given,
                       std::span<const double> features, std::size_t n_features, double factor,
                       ThreadTeam& team, std::span<double> weights) {
  SUPERFACETS_ASSERT(std::ssize(given) == arcs.n_arcs() && weights.size() == given.size());
  SUPERFACETS_ASSERT(std::cmp_equal(features.size(), arcs.n_cells() * n_features));
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    const double* here = features.data() + n_features * cell;
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const double* there = features.data() + n_features * neighbor;
      double squared = 0.0;
      for (std::size_t i = 0; i < n_features; ++i) {
        squared += (here[i] - there[i]) * (here[i] - there[i]);
      }
      weights[arc] = given[arc] + factor * std::sqrt(squared);
    }
  });
}

}  // namespace superfacets
