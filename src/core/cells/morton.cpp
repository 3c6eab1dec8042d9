#include "cells/morton.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {
namespace {

constexpr int kBitsPerAxis = 10;
constexpr int kDigitBits = 10;  // three passes of a radix sort, each with a table that fits in L1
constexpr std::uint32_t kDigits = 1U << kDigitBits;

struct Entry {
  std::uint32_t code;
  Cell cell;
};

// Spreads the lower ten bits of a number so that two zeros follow each.
std::uint32_t spread(std::uint32_t bits) {
  bits = (bits | bits << 16) & 0x030000ffU;
  bits = (bits | bits << 8) & 0x0300f00fU;
  bits = (bits | bits << 4) & 0x030c30c3U;
  return (bits | bits << 2) & 0x09249249U;
}

std::uint32_t step_of(double coordinate, double low, double steps_per_length) {
  constexpr double kLast = (1 << kBitsPerAxis) - 1;
  return static_cast<std::uint32_t>(std::clamp((coordinate - low) * steps_per_length, 0.0, kLast));
}

Buffer<Entry> code_cells(std::span<const Point> positions, const Box& bounds, ThreadTeam& team) {
  const Point extent = bounds.high - bounds.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double scale = longest > 0.0 ? (1 << kBitsPerAxis) / longest : 0.0;
  const Point low = bounds.low;
  Buffer<Entry> entries(positions.size());
  auto code_range = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t cell = begin; cell < end; ++cell) {
      const Point p = positions[cell];
      SUPERFACETS_ASSERT(bounds.squared_distance(p) == 0.0);
      const std::uint32_t code = spread(step_of(p.x, low.x, scale)) |
                                 spread(step_of(p.y, low.y, scale)) << 1 |
                                 spread(step_of(p.z, low.z, scale)) << 2;
      entries[cell] = {code, static_cast<Cell>(cell)};
    }
  };
  team.for_each_block(static_cast<std::int64_t>(positions.size()), code_range);
  return entries;
}

// One pass of a radix sort, on the digit that starts at bit `shift`. Each thread counts and moves
// one part of the entries. The write cursors are ordered by digit, then by part, so that the pass
// is stable and the result does not depend on the number of parts.
void sort_by_digit(const Buffer<Entry>& entries, int shift, Buffer<Entry>& sorted,
                   ThreadTeam& team) {
  const auto n = static_cast<std::int64_t>(entries.size());
  const std::int64_t n_parts = team.size();
  std::vector<std::array<std::int64_t, kDigits>> next(n_parts);  // write cursor of each digit
  auto digit_of = [&](const Entry& entry) { return entry.code >> shift & (kDigits - 1); };
  auto count_part = [&](std::int64_t part, int) {
    next[part].fill(0);
    for (auto i = n * part / n_parts; i < n * (part + 1) / n_parts; ++i) {
      ++next[part][digit_of(entries[i])];
    }
  };
  auto move_part = [&](std::int64_t part, int) {
    for (auto i = n * part / n_parts; i < n * (part + 1) / n_parts; ++i) {
      sorted[next[part][digit_of(entries[i])]++] = entries[i];
    }
  };
  team.for_each(n_parts, count_part);
  std::int64_t n_before = 0;
  for (std::uint32_t digit = 0; digit < kDigits; ++digit) {
    for (auto& of_part : next) n_before += std::exchange(of_part[digit], n_before);
  }
  team.for_each(n_parts, move_part);
}

}  // namespace

Buffer<Cell> morton_order(std::span<const Point> positions, const Box& bounds, ThreadTeam& team) {
  Buffer<Entry> entries = code_cells(positions, bounds, team);
  Buffer<Entry> sorted(entries.size());  // the other half of each pass
  for (int shift = 0; shift < 3 * kBitsPerAxis; shift += kDigitBits) {
    sort_by_digit(entries, shift, sorted, team);
    std::swap(entries, sorted);
  }
  Buffer<Cell> order(entries.size());
  auto keep_cells = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t place = begin; place < end; ++place) order[place] = entries[place].cell;
  };
  team.for_each_block(static_cast<std::int64_t>(order.size()), keep_cells);
  return order;
}

}  // namespace superfacets
