#include "cells/quantization.hpp"

#include "base/elementary.hpp"

namespace superfacets {

double quantize_weights(std::span<const double> weights, ThreadTeam& team,
                        std::span<float> lengths) {
  const double unit = unit_of_lengths(sum_of(weights, team));
  round_weights(weights, unit, team, lengths);
  return unit;
}

double unit_of_lengths(double total_weight) {
  // The unit is a power of two, so rounding only cuts the last bits of a weight. A sum computed in
  // another order of the arcs may differ in its last bits, but nearly always gives the same unit.
  return total_weight > 0.0 ? std::ldexp(1.0, std::ilogb(total_weight) + 1 - kTotalBits) : 1.0;
}

void round_weights(std::span<const double> weights, double unit, ThreadTeam& team,
                   std::span<float> lengths) {
  SUPERFACETS_ASSERT(lengths.size() == weights.size());
  const auto n_arcs = static_cast<std::int64_t>(weights.size());
  team.for_each_index(n_arcs, [&](std::int64_t arc) {
    // Rounds to the 24 bits of a float. The result is at least 1, so every arc makes a path longer.
    lengths[arc] = static_cast<float>(std::max(1.0, round_to_whole(weights[arc] / unit)));
  });
}

}  // namespace superfacets
