// Stage 5: segments of borders, put together to lines.
#pragma once

#include <vector>

#include "base/types.hpp"

namespace superfacets {

// An end of a segment: 2 i for the start of segment i, 2 i + 1 for its end.
using SegmentEnd = std::int64_t;

inline constexpr SegmentEnd kNoEnd = -1;

struct Lines {
  std::vector<std::int64_t> offsets;     // (L + 1,) line i: entries[offsets[i]] .. [offsets[i+1]-1]
  std::vector<SegmentEnd> entries;       // (S,) by which each segment is entered, along the lines
  std::vector<std::uint8_t> are_closed;  // (L,)
};

// Follows each line from segment to segment. `partners` holds for each end of a segment that of
// another one which goes on there, or kNoEnd; partners are mutual. Lines with ends come first, and
// begin with the start of a segment where one of their ends is such; then closed ones, which begin
// with the start of their lowest segment. Time O(S).
Lines trace_lines(std::span<const SegmentEnd> partners);

}  // namespace superfacets
