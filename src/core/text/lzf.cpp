#include "text/lzf.hpp"

#include <cstring>

namespace superfacets {
namespace {

// A control byte c < kLiteral is followed by c + 1 literal bytes.
constexpr std::size_t kLiteral = 32;
// If a match length has this value, the next byte is added to the length.
constexpr std::size_t kLong = 7;

// Appends a copy of `size` bytes that begin `distance` bytes before `end`. If size > distance, the
// copy repeats these bytes.
void repeat(std::uint8_t* end, std::size_t distance, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) end[i] = *(end + i - distance);
}

}  // namespace

Buffer<std::uint8_t> unpack_lzf(std::span<const std::uint8_t> packed, std::int64_t n_bytes) {
  Buffer<std::uint8_t> content(static_cast<std::size_t>(n_bytes));
  std::size_t place = 0;
  std::size_t n_done = 0;
  while (place < packed.size()) {
    const std::size_t control = packed[place++];
    const std::size_t n_packed = packed.size() - place;
    const std::size_t n_free = content.size() - n_done;
    if (control < kLiteral) {
      const std::size_t size = control + 1;
      if (size > n_packed || size > n_free) return {};
      std::memcpy(content.data() + n_done, packed.data() + place, size);
      place += size;
      n_done += size;
      continue;
    }
    std::size_t size = control >> 5;
    if (n_packed < (size == kLong ? 2U : 1U)) return {};
    if (size == kLong) size += packed[place++];
    size += 2;
    const std::size_t distance = ((control & 31) << 8) + packed[place++] + 1;
    if (distance > n_done || size > n_free) return {};
    repeat(content.data() + n_done, distance, size);
    n_done += size;
  }
  return n_done == content.size() ? std::move(content) : Buffer<std::uint8_t>{};
}

}  // namespace superfacets
