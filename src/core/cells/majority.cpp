#include "cells/majority.hpp"

#include "base/radix_sort.hpp"

namespace superfacets {
namespace {

struct Member {
  // sort key: the group in the upper bits, label + 1 in the lower bits (0 for kNoLabel)
  std::uint64_t key;
  double weight;

  Member(Cell group, Label label, double w)
      : key(static_cast<std::uint64_t>(group) << 32 | (static_cast<std::uint32_t>(label) + 1U)),
        weight(w) {}
  Cell group() const { return static_cast<Cell>(key >> 32); }
  Label label() const { return static_cast<Label>(static_cast<std::uint32_t>(key) - 1U); }
};

// Writes the winning label of each group. Weights are summed in the order of the sorted members.
void find_winners(std::span<const Member> members, std::span<Label> winners) {
  double best = -1.0;
  for (std::size_t begin = 0; begin < members.size();) {
    const Member& first = members[begin];
    if (begin == 0 || members[begin - 1].group() != first.group()) best = -1.0;
    double sum = 0.0;
    std::size_t end = begin;
    for (; end < members.size() && members[end].key == first.key; ++end) sum += members[end].weight;
    if (sum > best) winners[first.group()] = first.label();
    best = std::max(best, sum);
    begin = end;
  }
}

}  // namespace

Majority weighted_majority(std::span<const Cell> groups, std::span<const Label> labels,
                           std::span<const double> weights, Cell n_groups) {
  SUPERFACETS_ASSERT(groups.size() == labels.size() && groups.size() == weights.size() &&
                     all_below(groups, n_groups));
  // Weights are only summed for groups with several labels.
  Majority majority{Buffer<Label>(n_groups), Buffer<std::uint8_t>(n_groups)};
  std::ranges::fill(majority.winners, kNoLabel);
  std::ranges::fill(majority.is_divided, 0);
  for (std::size_t i = 0; i < groups.size(); ++i) majority.winners[groups[i]] = labels[i];
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (majority.winners[groups[i]] != labels[i]) majority.is_divided[groups[i]] = 1;
  }
  std::size_t n_members = 0;
  for (const Cell group : groups) n_members += majority.is_divided[group];
  Buffer<Member> members(n_members);
  std::size_t next = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (majority.is_divided[groups[i]] == 0) continue;
    members[next++] = Member(groups[i], labels[i], weights[i]);
  }
  radix_sort(members);
  find_winners(members.span(), majority.winners.span());
  return majority;
}

}  // namespace superfacets
