// The label that most of the weight of each group has.
#pragma once

#include <cstdint>
#include <span>

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

struct Majority {
  Buffer<Label> winners;            // of each group; kNoLabel if it has no members
  Buffer<std::uint8_t> is_divided;  // whether members of each group have different labels
};

// The label with the largest sum of weights among the members of each group, the lowest of equals.
// Member i is in groups[i], and has labels[i], which is kNoLabel (a label like others) or higher,
// and weights[i] >= 0. Time O(members + n_groups).
Majority weighted_majority(std::span<const Cell> groups, std::span<const Label> labels,
                           std::span<const double> weights, Cell n_groups);

}  // namespace superfacets
