#include "cells/quantization.hpp"

namespace superfacets {

QuantizedWeights quantize_weights(std::span<const double> weights, ThreadTeam& team) {
  const double unit = unit_of_lengths(sum_of(weights, team));
  return {round_weights(weights, unit, team), unit};
}

double unit_of_lengths(double total_weight) {
  // The unit is a power of two, so rounding only cuts the last bits of a weight. A sum computed in
  // another order of the arcs may differ in its last bits, but nearly always gives the same unit.
  return total_weight > 0.0 ? std::ldexp(1.0, std::ilogb(total_weight) + 1 - kTotalBits) : 1.0;
}

Buffer<float> round_weights(std::span<const double> weights, double unit, ThreadTeam& team) {
  Buffer<float> lengths(weights.size());
  team.for_each_index(std::ssize(weights),
                      [&](std::int64_t arc) { lengths[arc] = rounded_weight(weights[arc], unit); });
  return lengths;
}

}  // namespace superfacets
