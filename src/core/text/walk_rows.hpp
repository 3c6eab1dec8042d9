// Rows of a binary table whose lists differ in length: where each of them begins.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/buffer.hpp"

namespace superfacets {

// How a row stores a column: one value, or a list behind its length.
struct ColumnLayout {
  int count_size;  // bytes of the length of a list: 1, 2, 4 or 8; 0: one value
  bool is_count_signed;
  int value_size;  // bytes of a value
};

struct WalkedRows {
  Buffer<std::int64_t> starts;   // (R * columns,) first byte of the values, row by row
  Buffer<std::int64_t> lengths;  // (R * columns,) how many there are; may be negative
  std::int64_t end = 0;          // byte behind the last row
  std::int64_t n_whole = 0;      // rows that the bytes hold; what follows is not set
};

// Walks rows from byte `begin` on. A negative length counts as 0. Time O(R * columns), on one
// thread: where a row begins is known when the one before it was read.
WalkedRows walk_rows(std::span<const std::uint8_t> bytes, std::int64_t begin, std::int64_t n_rows,
                     std::span<const ColumnLayout> columns, bool is_big_endian);

}  // namespace superfacets
