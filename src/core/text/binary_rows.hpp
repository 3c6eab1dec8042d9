// Reads the rows of binary tables, such as PLY elements.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Location of the rows of a table. Row i consists of the bytes first[i * stride] .. first[i *
// stride + size - 1].
struct RowPlaces {
  const std::uint8_t* first = nullptr;
  std::int64_t stride = 0;
  std::int64_t n_rows = 0;
  std::int64_t size = 0;
};

// Copies rows to consecutive memory. This is faster than numpy, which copies unaligned numbers one
// by one.
Buffer<std::uint8_t> copy_rows(const RowPlaces& rows, ThreadTeam& team);

// Concatenates runs of bytes. Run i has sizes[i] >= 0 bytes, beginning with bytes[starts[i]].
Buffer<std::uint8_t> copy_runs(std::span<const std::uint8_t> bytes,
                               std::span<const std::int64_t> starts,
                               std::span<const std::int64_t> sizes, ThreadTeam& team);

// Layout of a column in a row: a single value, or a list stored as its length followed by its
// values.
struct ColumnLayout {
  // size of the stored length of a list, in bytes: 1, 2, 4 or 8; 0 for a single value
  int count_size;
  bool is_count_signed;
  int value_size;  // size of a value in bytes
};

struct WalkedRows {
  // (rows * columns,) index of the first byte of the value or list of each column, row by row
  Buffer<std::int64_t> starts;
  Buffer<std::int64_t> lengths;  // (rows * columns,) number of values, as stored; may be negative
  std::int64_t end = 0;  // one past the last byte of the last row; valid if all rows are complete
  std::int64_t n_whole = 0;  // number of complete rows; entries of later rows are not valid
};

// Finds the values of n_rows rows, beginning with the byte `begin`. Stops at a row that extends
// beyond the last byte. A list with a negative length is treated as empty. Time O(rows * columns).
// Runs on one thread, because the start of a row depends on the length of the previous row.
WalkedRows walk_rows(std::span<const std::uint8_t> bytes, std::int64_t begin, std::int64_t n_rows,
                     std::span<const ColumnLayout> columns, bool is_big_endian);

}  // namespace superfacets
