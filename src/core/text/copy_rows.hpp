// Copies strided rows of bytes, such as one field of all records of a binary file.
#pragma once

#include <cstdint>
#include <span>

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
// Numbers in records are not aligned: numpy would copy them one by one.
void copy_rows(const RowPlaces& rows, std::int64_t n_rows, ThreadTeam& team, std::uint8_t* copy);

// Copies runs of bytes one after the other. Run i has sizes[i] >= 0 bytes, from bytes[starts[i]]
// on.
Buffer<std::uint8_t> copy_runs(std::span<const std::uint8_t> bytes,
                               std::span<const std::int64_t> starts,
                               std::span<const std::int64_t> sizes, ThreadTeam& team);

}  // namespace superfacets
