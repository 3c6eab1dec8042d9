#include "cells/part_prices.hpp"

#include <cmath>

#include "base/assert.hpp"

namespace superfacets {

double PartVectors::distance(Cell one, Cell other) const {
  const float* here = rows.data() + width * one;
  const float* there = rows.data() + width * other;
  double squared = 0.0;
  for (std::size_t i = 0; i < width; ++i) {
    const double difference = static_cast<double>(here[i]) - static_cast<double>(there[i]);
    squared += difference * difference;
  }
  return std::sqrt(squared);
}

float with_price(float length, double factor, double distance) {
  return static_cast<float>(std::nearbyint(double{length} + factor * distance));
}

Buffer<float> add_part_prices(const Arcs& arcs, std::span<const float> lengths,
                              std::span<const Cell> group_of, const PartVectors& vectors,
                              double factor, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(lengths) == arcs.n_arcs());
  const auto group = [&](Cell cell) { return group_of.empty() ? cell : group_of[cell]; };
  Buffer<float> sums(lengths.size());
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    const Cell here = group(cell);
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const Cell there = group(neighbor);
      sums[arc] = here == there ? lengths[arc]
                                : with_price(lengths[arc], factor, vectors.distance(here, there));
    }
  });
  return sums;
}

}  // namespace superfacets
