#include "text/copy_rows.hpp"

#include <cstring>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// Copies rows of a size known at compile time: each memcpy is then a few instructions.
template <std::int64_t kSize>
void copy_sized(const RowPlaces& rows, std::int64_t begin, std::int64_t end, std::uint8_t* copy) {
  for (std::int64_t i = begin; i < end; ++i) {
    std::memcpy(copy + i * kSize, rows.first + i * rows.stride, kSize);
  }
}

void copy_any(const RowPlaces& rows, std::int64_t begin, std::int64_t end, std::uint8_t* copy) {
  for (std::int64_t i = begin; i < end; ++i) {
    std::memcpy(copy + i * rows.size, rows.first + i * rows.stride, rows.size);
  }
}

}  // namespace

void copy_rows(const RowPlaces& rows, std::int64_t n_rows, ThreadTeam& team, std::uint8_t* copy) {
  SUPERFACETS_ASSERT(n_rows >= 0 && rows.size > 0);
  team.for_each_block(n_rows, [&](std::int64_t begin, std::int64_t end) {
    switch (rows.size) {
      case 4:
        return copy_sized<4>(rows, begin, end, copy);
      case 12:
        return copy_sized<12>(rows, begin, end, copy);
      case 36:
        return copy_sized<36>(rows, begin, end, copy);
      default:
        return copy_any(rows, begin, end, copy);
    }
  });
}

Buffer<std::uint8_t> copy_runs(std::span<const std::uint8_t> bytes,
                               std::span<const std::int64_t> starts,
                               std::span<const std::int64_t> sizes, ThreadTeam& team) {
  const auto n_runs = static_cast<std::int64_t>(starts.size());
  Buffer<std::int64_t> places(starts.size());
  std::int64_t total = 0;
  for (std::int64_t run = 0; run < n_runs; ++run) {
    places[run] = total;
    total += sizes[run];
  }
  Buffer<std::uint8_t> copy(total);
  team.for_each_index(n_runs, [&](std::int64_t run) {
    SUPERFACETS_ASSERT(starts[run] + sizes[run] <= std::ssize(bytes));
    std::memcpy(copy.data() + places[run], bytes.data() + starts[run], sizes[run]);
  });
  return copy;
}

}  // namespace superfacets
