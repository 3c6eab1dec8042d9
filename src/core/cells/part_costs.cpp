#include "cells/part_costs.hpp"

namespace superfacets {
namespace {

// Adds factor times cost(group, other group) to the length of each arc between two groups.
template <typename Groups, typename Cost>
void add(const Arcs& arcs, std::span<float> lengths, const Groups& groups, double factor,
         const Cost& cost, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(lengths) == arcs.n_arcs());
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    const Cell here = groups.group_of(cell);
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const Cell there = groups.group_of(neighbor);
      if (here != there) lengths[arc] = with_cost(lengths[arc], factor, cost(here, there));
    }
  });
}

}  // namespace

Buffer<float> add_part_costs(const Arcs& arcs, std::span<const float> lengths,
                             const PartVectors& vectors, double factor, ThreadTeam& team) {
  const auto cost = [&](Cell here, Cell there) { return vectors.distance(here, there); };
  Buffer<float> sums(lengths.size());
  team.for_each_index(std::ssize(lengths), [&](std::int64_t arc) { sums[arc] = lengths[arc]; });
  add(arcs, sums.span(), vectors, factor, cost, team);
  return sums;
}

void add_group_costs(const Arcs& arcs, std::span<float> lengths, const GroupCosts& costs,
                     ThreadTeam& team) {
  const auto cost = [&](Cell here, Cell there) { return costs.between(here, there); };
  add(arcs, lengths, costs, 1.0, cost, team);
}

Buffer<double> add_feature_steps(const Arcs& arcs, std::span<const double> given,
                                 std::span<const double> features, std::size_t n_features,
                                 double factor, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(given) == arcs.n_arcs());
  SUPERFACETS_ASSERT(std::cmp_equal(features.size(), arcs.n_cells() * n_features));
  Buffer<double> weights(given.size());
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      weights[arc] = given[arc] + factor * distance_between(features, n_features, cell, neighbor);
    }
  });
  return weights;
}

}  // namespace superfacets
