// Stage 2: rounding of weights to whole units, so that sums of lengths are exact.
#pragma once

#include "base/buffer.hpp"
#include "base/elementary.hpp"
#include "base/threads.hpp"

namespace superfacets {

// The sum of all weights, an upper bound of path lengths, is less than 2^kTotalBits units. So path
// lengths fit into 64 bits, and are exact in a double. On a mesh of 10 million faces, an arc of
// mean length has about 2^23 units, which is precise enough even if a few arcs are 2^20 times as
// long.
inline constexpr int kTotalBits = 48;

struct QuantizedWeights {
  Buffer<float> lengths;  // whole numbers of units, at least 1
  double unit;
};

// Rounds finite weights >= 0 to whole units, at least 1. The unit is the power of two between 2^-48
// and 2^-47 of the sum of the weights (1 if all weights are 0). The result is the same for any
// number of threads.
QuantizedWeights quantize_weights(std::span<const double> weights, ThreadTeam& team);

// The two steps of quantize_weights. unit_of_lengths returns the unit for a given sum of weights.
// round_weights rounds weights to multiples of a given unit.
double unit_of_lengths(double total_weight);
inline float rounded_weight(double weight, double unit) {
  // Rounds to the 24 bits of a float. The result is at least 1, so every arc makes a path longer.
  return static_cast<float>(std::max(1.0, round_to_whole(weight / unit)));
}
Buffer<float> round_weights(std::span<const double> weights, double unit, ThreadTeam& team);

}  // namespace superfacets
