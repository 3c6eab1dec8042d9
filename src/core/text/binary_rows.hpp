// Reads rows of binary tables.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Row i has the bytes first[i * stride] .. first[i * stride + size - 1].
struct RowPlaces {
  const std::uint8_t* first = nullptr;
  std::int64_t stride = 0;
  std::int64_t size = 0;
};

// Writes the rows one after the other to `copy`, which has room for n_rows * rows.size bytes.
// Faster than numpy, which copies unaligned numbers one by one.
void copy_rows(const RowPlaces& rows, std::int64_t n_rows, ThreadTeam& team, std::uint8_t* copy);

// Concatenates runs of bytes. Run i has sizes[i] >= 0 bytes, from bytes[starts[i]] on.
Buffer<std::uint8_t> copy_runs(std::span<const std::uint8_t> bytes,
                               std::span<const std::int64_t> starts,
                               std::span<const std::int64_t> sizes, ThreadTeam& team);

// Layout of a column in a row: a single value, or a list stored as its length followed by its
// values.
struct ColumnLayout {
  // size of the stored length of a list, in bytes: 1, 2, 4 or 8; 0 for a single value
  int count_size;
  bool is_count_signed;
  int value_size;  // bytes of a value
};

struct WalkedRows {
  Buffer<std::int64_t> starts;   // (R * columns,) index of the first byte of the values, row by row
  Buffer<std::int64_t> lengths;  // (R * columns,) number of values; may be negative
  std::int64_t end = 0;  // one past the last byte of the last row; valid if all rows are complete
  std::int64_t n_whole = 0;  // number of complete rows; entries of later rows are not valid
};

// Finds the values of n_rows rows from byte `begin` on. Stops at a row that extends beyond the end
// of the bytes. A negative length counts as 0. Time O(R * columns). Runs on one thread, because the
// start of a row is known only after reading the previous row.
WalkedRows walk_rows(std::span<const std::uint8_t> bytes, std::int64_t begin, std::int64_t n_rows,
                     std::span<const ColumnLayout> columns, bool is_big_endian);

}  // namespace superfacets
