#include "spatial/morton.hpp"

#include <array>
#include <bit>

#include "base/lists.hpp"

namespace superfacets {
namespace {

constexpr int kBitsPerAxis = 10;
constexpr int kDigitBits = 10;  // so that the tables of one digit fit into the first-level cache
static_assert(kCodeBits == 3 * kBitsPerAxis && kCodeBits == 3 * kDigitBits);
constexpr std::uint32_t kDigits = 1U << kDigitBits;

struct Entry {
  std::uint32_t code;
  Cell cell;
};

// Spreads the lower ten bits of a number: inserts two zeros between neighboring bits.
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

std::uint32_t digit_of(std::uint32_t code, int digit) {
  return code >> (digit * kDigitBits) & (kDigits - 1);
}

// Sorts entries by the two lower digits of their codes (radix sort), and writes them as the
// elements from `begin` on.
void sort_by_low_digits(std::span<const Entry> entries, std::vector<Entry>& sorted,
                        std::int64_t begin, SortedCodes& all) {
  if (entries.empty()) return;
  std::array<std::int64_t, kDigits> first{};
  std::array<std::int64_t, kDigits> second{};
  for (const Entry& entry : entries) {
    ++first[digit_of(entry.code, 0)];
    ++second[digit_of(entry.code, 1)];
  }
  std::exclusive_scan(first.begin(), first.end(), first.begin(), std::int64_t{0});
  std::exclusive_scan(second.begin(), second.end(), second.begin(), begin);
  if (sorted.size() < entries.size()) sorted.resize(entries.size());
  for (const Entry& entry : entries) sorted[first[digit_of(entry.code, 0)]++] = entry;
  for (const Entry& entry : std::span(sorted).first(entries.size())) {
    const std::int64_t place = second[digit_of(entry.code, 1)]++;
    all.order[place] = entry.cell;
    all.codes[place] = entry.code;
  }
}

// Orders cells by recursive splits at the median along the longest axis of their box, until a part
// has at most n_together cells. Both halves have about the same number of cells, so the recursion
// also ends if cells coincide.
void order_by_halves(std::span<const Point> positions, std::span<Cell> cells,
                     std::size_t n_together) {
  // Small parts are sorted, because the order after nth_element depends on the standard library.
  if (cells.size() <= n_together) {
    std::ranges::sort(cells, [&](Cell a, Cell b) {
      return std::tie(positions[a], a) < std::tie(positions[b], b);
    });
    return;
  }
  Box box;
  for (const Cell cell : cells) box.include(positions[cell]);
  const Point extent = box.high - box.low;
  double Point::* axis = &Point::x;
  if (extent.y > extent.*axis) axis = &Point::y;
  if (extent.z > extent.*axis) axis = &Point::z;
  const auto middle = cells.begin() + static_cast<std::ptrdiff_t>(cells.size() / 2);
  std::nth_element(cells.begin(), middle, cells.end(), [&](Cell a, Cell b) {
    return std::tie(positions[a].*axis, positions[a], a) <
           std::tie(positions[b].*axis, positions[b], b);
  });
  order_by_halves(positions, {cells.begin(), middle}, n_together);
  order_by_halves(positions, {middle, cells.end()}, n_together);
}

}  // namespace

// Sorts by the highest digit first, so that the sorting by the other digits takes place within the
// second-level cache.
SortedCodes sorted_codes(Buffer<std::uint32_t> codes, ThreadTeam& team) {
  const auto n = std::ssize(codes);
  const Lists<Entry> by_digit = group<Entry>(
      n, kDigits,
      [&](std::int64_t begin, std::int64_t end, const auto& add) {
        for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
          SUPERFACETS_ASSERT(codes[cell] >> kCodeBits == 0);
          add(digit_of(codes[cell], 2), {codes[cell], cell});
        }
      },
      team);
  codes = {};
  SortedCodes all{Buffer<std::uint32_t>(n), Buffer<Cell>(n)};
  std::vector<std::vector<Entry>> of_thread(team.size());
  team.for_each(kDigits, [&](std::int64_t digit, int thread) {
    sort_by_low_digits(by_digit[digit], of_thread[thread], by_digit.offsets[digit], all);
  });
  return all;
}

Curve::Curve(const Box& bounds) : bounds_(bounds) {
  const Point extent = bounds.high - bounds.low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  scale_ = longest > 0.0 ? (1 << kBitsPerAxis) / longest : 0.0;
}

std::uint32_t Curve::code_of(const Point& p) const {
  SUPERFACETS_ASSERT(bounds_.squared_distance(p) == 0.0);
  const Point& low = bounds_.low;
  return spread(step_of(p.x, low.x, scale_)) | spread(step_of(p.y, low.y, scale_)) << 1 |
         spread(step_of(p.z, low.z, scale_)) << 2;
}

Buffer<Cell> morton_order(std::span<const Point> positions, const Box& bounds, ThreadTeam& team) {
  return sorted_codes(morton_codes(positions, bounds, team), team).order;
}

Buffer<std::uint32_t> morton_codes(std::span<const Point> positions, const Box& bounds,
                                   ThreadTeam& team) {
  const Curve curve(bounds);
  Buffer<std::uint32_t> codes(positions.size());
  team.for_each_index(std::ssize(positions),
                      [&](std::int64_t cell) { codes[cell] = curve.code_of(positions[cell]); });
  return codes;
}

Buffer<Cell> refined_morton_order(std::span<const Point> positions, std::size_t n_together,
                                  ThreadTeam& team) {
  SortedCodes sorted =
      sorted_codes(morton_codes(positions, bounds_of(positions, team), team), team);
  const auto order_run = [&](std::span<Cell> cells) {
    order_by_halves(positions, cells, n_together);
  };
  for_each_run(sorted, order_run, team);
  return std::move(sorted.order);
}

std::vector<Place> octant_ranges(std::span<const std::uint32_t> codes, std::size_t n_together) {
  std::vector<Place> starts;
  const auto split = [&](const auto& self, std::size_t first, std::size_t last) -> void {
    if (last - first <= n_together) return starts.push_back(static_cast<Place>(first));
    std::size_t middle = first + (last - first) / 2;
    if (codes[first] != codes[last - 1]) {
      const auto highest = std::bit_floor(codes[first] ^ codes[last - 1]);
      const auto is_low = [&](std::uint32_t code) { return (code & highest) == 0; };
      middle =
          std::ranges::partition_point(codes.subspan(first, last - first), is_low) - codes.begin();
    }
    self(self, first, middle);
    self(self, middle, last);
  };
  split(split, 0, codes.size());
  starts.push_back(static_cast<Place>(codes.size()));
  return starts;
}

}  // namespace superfacets
