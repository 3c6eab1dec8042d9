// Weighted majority of the labels in each group.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

struct Majority {
  Buffer<Label> winners;            // winning label of each group; kNoLabel if it has no members
  Buffer<std::uint8_t> is_divided;  // 1 if the members of a group have different labels
};

// For each group, finds the label with the largest sum of weights among its members. If several
// labels have the same sum, the lowest is chosen. Member i belongs to groups[i], and has labels[i]
// and weights[i] >= 0. kNoLabel is the lowest label, and is treated like any other. Time O(members
// + n_groups).
Majority weighted_majority(std::span<const Cell> groups, std::span<const Label> labels,
                           std::span<const double> weights, Cell n_groups);

}  // namespace superfacets
