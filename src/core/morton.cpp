#include "morton.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace superfacets {
namespace {

constexpr int kBitsPerAxis = 10;
constexpr int kDigitBits = 10;  // three passes of a radix sort, each with a table that fits in L1
constexpr std::uint32_t kDigits = 1U << kDigitBits;

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

std::vector<std::uint32_t> morton_codes(std::span<const Point> positions) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Point low{kInfinity, kInfinity, kInfinity};
  Point high{-kInfinity, -kInfinity, -kInfinity};
  for (const Point& p : positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Point extent = high - low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double scale = longest > 0.0 ? (1 << kBitsPerAxis) / longest : 0.0;
  std::vector<std::uint32_t> codes;
  codes.reserve(positions.size());
  for (const Point& p : positions) {
    codes.push_back(spread(step_of(p.x, low.x, scale)) | spread(step_of(p.y, low.y, scale)) << 1 |
                    spread(step_of(p.z, low.z, scale)) << 2);
  }
  return codes;
}

// One stable pass of a radix sort, on the digit that starts at bit `shift`.
void sort_by_digit(std::span<const std::uint32_t> codes, int shift, std::span<const Cell> order,
                   std::span<Cell> sorted) {
  std::array<std::int64_t, kDigits + 1> next{};  // free place of each digit
  auto digit_of = [&](Cell cell) { return codes[cell] >> shift & (kDigits - 1); };
  for (const Cell cell : order) ++next[digit_of(cell) + 1];
  for (std::uint32_t digit = 1; digit <= kDigits; ++digit) next[digit] += next[digit - 1];
  for (const Cell cell : order) sorted[next[digit_of(cell)]++] = cell;
}

}  // namespace

std::vector<Cell> morton_order(std::span<const Point> positions) {
  const std::vector<std::uint32_t> codes = morton_codes(positions);
  std::vector<Cell> order(positions.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Cell>(i);
  std::vector<Cell> sorted(order.size());  // the other half of each pass
  for (int shift = 0; shift < 3 * kBitsPerAxis; shift += kDigitBits) {
    sort_by_digit(codes, shift, order, sorted);
    std::swap(order, sorted);
  }
  return order;
}

}  // namespace superfacets
