// A stable sort by unsigned keys, in linear time.
#pragma once

#include <array>

#include "base/buffer.hpp"

namespace superfacets {

// Sorts entries by their member `key`, an unsigned integer of 64 bits. Entries with equal keys keep
// their order. Digits that are equal in all keys are skipped. Uses a second array of the same size.
template <typename Entry>
void radix_sort(Buffer<Entry>& entries) {
  constexpr int kDigitBits =
      11;  // so that the write cursors of one pass fit into the first-level cache
  constexpr std::uint64_t kDigits = 1 << kDigitBits;
  constexpr int kPasses = (64 + kDigitBits - 1) / kDigitBits;
  const auto digit_of = [](const Entry& entry, int pass) {
    return entry.key >> (pass * kDigitBits) & (kDigits - 1);
  };
  Buffer<std::array<std::size_t, kDigits>> counts(kPasses);
  for (auto& of_pass : counts) of_pass.fill(0);
  for (const Entry& entry : entries) {
    for (int pass = 0; pass < kPasses; ++pass) ++counts[pass][digit_of(entry, pass)];
  }
  Buffer<Entry> sorted(entries.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    auto& next = counts[pass];  // counts, converted below to the write cursor of each digit
    if (std::ranges::find(next, entries.size()) != next.end()) continue;
    std::size_t n_before = 0;
    for (std::size_t& count : next) n_before += std::exchange(count, n_before);
    for (const Entry& entry : entries) sorted[next[digit_of(entry, pass)]++] = entry;
    std::swap(entries, sorted);
  }
}

}  // namespace superfacets
