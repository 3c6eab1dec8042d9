// Finds the rows of a binary table whose lists differ in length.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/buffer.hpp"

namespace superfacets {

// Layout of a column in a row: one value, or a list after its length.
struct ColumnLayout {
  int count_size;  // bytes of the length of a list: 1, 2, 4 or 8; 0: a single value
  bool is_count_signed;
  int value_size;  // bytes of a value
};

struct WalkedRows {
  Buffer<std::int64_t> starts;   // (R * columns,) first byte of the values, row by row
  Buffer<std::int64_t> lengths;  // (R * columns,) number of values; may be negative
  std::int64_t end = 0;          // one past the last byte of the last row
  std::int64_t n_whole = 0;      // complete rows; entries past these are not set
};

// Walks rows from byte `begin` on. A negative length counts as 0. Time O(R * columns), on one
// thread: the start of a row is known only after reading the previous one.
WalkedRows walk_rows(std::span<const std::uint8_t> bytes, std::int64_t begin, std::int64_t n_rows,
                     std::span<const ColumnLayout> columns, bool is_big_endian);

}  // namespace superfacets
