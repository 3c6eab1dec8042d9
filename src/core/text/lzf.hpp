// Decompresses LZF data, the compressed format of PCD files.
#pragma once

#include "base/buffer.hpp"

namespace superfacets {

// Decompresses `packed` to n_bytes bytes. Returns an empty buffer if `packed` is damaged: if it
// ends too early, refers to bytes before the first byte, or decompresses to more than n_bytes
// bytes.
Buffer<std::uint8_t> unpack_lzf(std::span<const std::uint8_t> packed, std::int64_t n_bytes);

}  // namespace superfacets
