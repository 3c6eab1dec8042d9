#include "cells/part_weights.hpp"

#include <cmath>

#include "base/assert.hpp"
#include "base/buffer.hpp"
#include "base/exponential.hpp"

namespace superfacets {
namespace {

Buffer<double> exponentials(std::span<const double> exponents, ThreadTeam& team) {
  Buffer<double> found(exponents.size());
  team.for_each_index(std::ssize(exponents), [&](std::int64_t i) {
    const double x = exponents[i];
    found[i] = x > 0.0 ? 1.0 / exponential(-x) : exponential(x);
  });
  return found;
}

double distance(const float* one, const float* other, std::size_t n) {
  double squared = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double difference = static_cast<double>(one[i]) - static_cast<double>(other[i]);
    squared += difference * difference;
  }
  return std::sqrt(squared);
}

}  // namespace

void part_weights(const Arcs& arcs, std::span<const double> given, const PartFeatures& features,
                  ThreadTeam& team, std::span<double> weights) {
  SUPERFACETS_ASSERT(std::ssize(given) == arcs.n_arcs() && weights.size() == given.size());
  SUPERFACETS_ASSERT(features.vectors.size() == features.n_vectors * features.exponents.size());
  const std::span<const Cell> groups = features.group_of;
  const Buffer<double> scales = exponentials(features.exponents, team);
  const auto group_of = [&](Cell cell) { return groups.empty() ? cell : groups[cell]; };
  const auto row = [&](Cell group) { return features.vectors.data() + features.n_vectors * group; };
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    const Cell here = group_of(cell);
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const Cell there = group_of(neighbor);
      const double step = here == there ? 0.0 : distance(row(here), row(there), features.n_vectors);
      weights[arc] = (given[arc] + features.factor * step) * (scales[here] * scales[there]);
    }
  });
}

}  // namespace superfacets
