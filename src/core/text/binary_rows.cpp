#include "text/binary_rows.hpp"

#include <cstring>
#include <numeric>

namespace superfacets {
namespace {

std::int64_t read_count(const std::uint8_t* bytes, const ColumnLayout& column, bool is_big_endian) {
  const int size = column.count_size;
  std::uint64_t value = 0;
  for (int i = 0; i < size; ++i) value = value << 8 | bytes[is_big_endian ? i : size - 1 - i];
  const int unused = 64 - 8 * size;
  if (!column.is_count_signed) return static_cast<std::int64_t>(value);
  return static_cast<std::int64_t>(value << unused) >> unused;  // the right shift extends the sign
}

}  // namespace

Buffer<std::uint8_t> copy_rows(const RowPlaces& rows, ThreadTeam& team) {
  SUPERFACETS_ASSERT(rows.n_rows >= 0 && rows.size > 0);
  const auto copy_all = [&](auto size) {
    Buffer<std::uint8_t> copy(rows.n_rows * size);
    team.for_each_index(rows.n_rows, [&, data = copy.data()](std::int64_t i) {
      std::memcpy(data + i * size, rows.first + i * rows.stride, size);
    });
    return copy;
  };
  switch (rows.size) {  // a memcpy of constant size compiles to a few instructions
    case 4:
      return copy_all(std::integral_constant<std::int64_t, 4>{});
    case 12:
      return copy_all(std::integral_constant<std::int64_t, 12>{});
    case 36:
      return copy_all(std::integral_constant<std::int64_t, 36>{});
    default:
      return copy_all(rows.size);
  }
}

Buffer<std::uint8_t> copy_runs(std::span<const std::uint8_t> bytes,
                               std::span<const std::int64_t> starts,
                               std::span<const std::int64_t> sizes, ThreadTeam& team) {
  Buffer<std::int64_t> places(starts.size());
  std::exclusive_scan(sizes.begin(), sizes.end(), places.begin(), std::int64_t{0});
  Buffer<std::uint8_t> copy(std::accumulate(sizes.begin(), sizes.end(), std::int64_t{0}));
  team.for_each_index(std::ssize(starts), [&](std::int64_t run) {
    SUPERFACETS_ASSERT(starts[run] + sizes[run] <= std::ssize(bytes));
    std::memcpy(copy.data() + places[run], bytes.data() + starts[run], sizes[run]);
  });
  return copy;
}

WalkedRows walk_rows(std::span<const std::uint8_t> bytes, std::int64_t begin, std::int64_t n_rows,
                     std::span<const ColumnLayout> columns, bool is_big_endian) {
  const auto n_bytes = static_cast<std::int64_t>(bytes.size());
  SUPERFACETS_ASSERT(begin >= 0 && begin <= n_bytes && n_rows >= 0);
  const std::size_t n_places = static_cast<std::size_t>(n_rows) * columns.size();
  WalkedRows rows{Buffer<std::int64_t>(n_places), Buffer<std::int64_t>(n_places), begin, 0};
  std::size_t place = 0;
  for (; rows.n_whole < n_rows; ++rows.n_whole) {
    for (const ColumnLayout& column : columns) {
      std::int64_t length = 1;
      if (column.count_size > 0) {
        if (rows.end + column.count_size > n_bytes) return rows;
        length = read_count(&bytes[rows.end], column, is_big_endian);
        rows.end += column.count_size;
      }
      rows.starts[place] = rows.end;
      rows.lengths[place] = length;
      ++place;
      rows.end += column.value_size * std::max<std::int64_t>(length, 0);
      if (rows.end > n_bytes) return rows;
    }
  }
  return rows;
}

}  // namespace superfacets
